/* SPDX-License-Identifier: BSD-3-Clause */
/* Starts, searches and their best result. Parameters are those of the unit cube between their bounds. */
#include "studies/optimize/optimize_study.h"
#include "base/clock.h"
#include "base/memory.h"
#include "base/thread_pool.h"
#include "constraints/tolerances.h"
#include "studies/ensemble/sampling/designs.h"
#include "studies/optimize/searches.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_EVALUATIONS = 500, POOL = 8, MOST_STARTS = 100000 };

/* -- starts ------------------------------------------------------------------------------------------ */

/* Places of the pool that run: those that keep the limits by their value, then the others. */
typedef struct place {
    int number;
    double value, broken;
} place;

static int order_places(const void *a, const void *b)
{
    const place *x = a, *y = b;
    if (x->broken != y->broken)
        return x->broken < y->broken ? -1 : 1;
    if (x->value != y->value)
        return x->value < y->value ? -1 : 1;
    return (x->number > y->number) - (x->number < y->number);
}

static void sobol_place(const kempe_optimum *o, int k, double *cube)
{
    for (int c = 0; c < o->count; c++)
        cube[c] = kmp_design_point(KMP_DESIGN_SOBOL, 1, (uint64_t)k, 0, c, o->count);
}

static kempe_status judge_pool(kempe_optimum *o, int count, place *places, double *x, double *values, int *running)
{
    int width = o->objective.list->run.values;
    for (int k = 0; k < count; k++) {
        double *row = x + (ptrdiff_t)k * o->count;
        sobol_place(o, k, row);
        kmp_optimum_leave_cube(o, row, row);
    }
    KMP_TRY(kmp_objective_values(&o->objective, count, x, values));
    *running = 0;
    for (int k = 0; k < count; k++) {
        const double *row = values + (ptrdiff_t)k * width;
        double broken = kmp_optimum_broken(o, row, NULL);
        if (isfinite(row[0]) && isfinite(broken))
            places[(*running)++] = (place){k, o->most_wanted ? -row[0] : row[0], broken};
    }
    qsort(places, (size_t)*running, sizeof *places, order_places);
    return KEMPE_OK;
}

/* Cubes of all starts; their number: the pool may have fewer places that run. */
static kempe_status find_starts(kempe_optimum *o, double *cubes, int *found)
{
    int count = o->pool * (o->starts - 1), running = 0, width = o->objective.list->run.values;
    kmp_arena arena = {0};
    place *places = KMP_ARENA_NEW(&arena, place, count);
    double *x = KMP_ARENA_NEW(&arena, double, (ptrdiff_t)count * o->count);
    double *values = KMP_ARENA_NEW(&arena, double, (ptrdiff_t)count *width);
    for (int k = 0; k < o->count; k++)
        cubes[k] = (o->start[k] - o->bounded.lower[k]) / (o->bounded.upper[k] - o->bounded.lower[k]);
    kempe_status status = kmp_made(o->context, !arena.failed);
    if (status == KEMPE_OK && count > 0)
        status = judge_pool(o, count, places, x, values, &running);
    *found = 1;
    for (int k = 0; k < running && *found < o->starts && status == KEMPE_OK; k++, ++*found)
        sobol_place(o, places[k].number, cubes + (ptrdiff_t)*found * o->count);
    kmp_arena_free(&arena);
    return status;
}

/* -- the result --------------------------------------------------------------------------------------- */

enum { COARSER = 100 };

/* The quantities at the optimum, and their change with the tolerance of the runs. */
static kempe_status settle(kempe_optimum *o)
{
    if (o->best < 0)
        return kmp_fail(o->context, KEMPE_E_FAILED, "the model runs at no start: %s",
                        o->search[0].refusal ? o->search[0].refusal : "");
    memcpy(o->value, o->search[o->best].x, (size_t)o->count * sizeof *o->value);
    KMP_TRY(kmp_objective_coarser(&o->objective, COARSER, o->value, o->values));
    const bool quiet = kmp_context_quiet(o->context, false); /* what its run is doubted for */
    kempe_status run = kmp_objective_values(&o->objective, 1, o->value, o->at_best);
    (void)kmp_context_quiet(o->context, quiet);
    KMP_TRY(run);
    o->coarser = fabs(o->values[0] - o->at_best[0]);
    const char *const *names = (const char *const *)o->bounded.name;
    kmp_text why = {0};
    KMP_TRY(kmp_variant_new(o->model, o->count, names, &o->variant));
    kempe_status status = kmp_variant_set(o->variant, o->value, &why);
    kmp_text_free(&why);
    return status;
}

static kempe_status search_all(kempe_optimum *o)
{
    int found = 0;
    double *cubes = KMP_ARENA_NEW(&o->arena, double, (ptrdiff_t)o->starts * o->count);
    o->search = KMP_ARENA_NEW(&o->arena, kmp_searched, o->starts);
    KMP_TRY(kmp_made(o->context, !o->arena.failed));
    KMP_TRY(find_starts(o, cubes, &found));
    for (int k = 0; k < found; k++) {
        o->search[k].number = k;
        o->search[k].x = cubes + (ptrdiff_t)k * o->count;
    }
    kempe_status status = kmp_searches_run(o, found);
    if (status == KEMPE_OK)
        return settle(o);
    if (status != KEMPE_STOPPED || o->best < 0)
        return status;
    kmp_model_begin_forces(o->model);
    KMP_TRY(settle(o));
    return kmp_fail(o->context, KEMPE_STOPPED, "interrupted after %d of %d searches: the best place so far is given",
                    o->searches, found);
}

/* -- options ----------------------------------------------------------------------------------------- */

static kempe_status prepare(kempe_optimum *o, const kempe_optimum_options *options)
{
    const char *quantity = options->minimize ? options->minimize : options->maximize;
    if (!kmp_minimum_available())
        return kmp_fail(o->context, KEMPE_E_FAILED,
                        "this build has no optimisation: install libnlopt-dev and build Kempe again");
    if (!options->minimize == !options->maximize)
        return kmp_fail(o->context, KEMPE_E_ARGUMENT, "either a quantity to minimise or one to maximise is expected");
    if (options->starts > MOST_STARTS || options->pool > MOST_STARTS)
        return kmp_fail(o->context, KEMPE_E_ARGUMENT, "at most %d starts, with a pool of %d each, are possible",
                        MOST_STARTS, MOST_STARTS);
    o->most_wanted = !options->minimize;
    o->starts = options->starts > 0 ? options->starts : 1;
    o->pool = options->pool > 0 ? options->pool : POOL;
    o->most = options->most > 0 ? options->most : MOST_EVALUATIONS;
    o->tolerance = options->tolerance > 0 ? options->tolerance : KMP_OPTIMUM_ENOUGH;
    KMP_TRY(kmp_bounded_read(o->context, options->parameters, &o->arena, &o->bounded));
    o->count = o->bounded.count;
    for (int k = 0; k < o->count; k++)
        if (!isfinite(o->bounded.upper[k] - o->bounded.lower[k]))
            return kmp_fail(o->context, KEMPE_E_ARGUMENT, "parameter '%s' needs two bounds, NAME:LOW:HIGH",
                            o->bounded.name[k]);
    KMP_TRY(o->count <= KMP_SOBOL_MOST
                ? KEMPE_OK
                : kmp_fail(o->context, KEMPE_E_ARGUMENT, "at most %d parameters are possible", (int)KMP_SOBOL_MOST));
    KMP_TRY(kmp_objective_init(&o->objective, o->model, o->count, (const char *const *)o->bounded.name, quantity,
                               options->limits, options->run));
    o->threads = o->objective.threads > 0 ? o->objective.threads : kmp_processors();
    int width = o->objective.list->run.values;
    o->limits = o->objective.list->limit_count;
    o->quantity = kmp_arena_strdup(&o->arena, quantity);
    o->limit_words = options->limits;
    KMP_TRY(kmp_made(o->context, KMP_ARENA_MAKE(&o->arena, KMP_ROOM(double, o->count, &o->start, &o->value),
                                                KMP_ROOM(double, width, &o->values, &o->at_best))));
    const char *file = options->start;
    kmp_variant *given = NULL;
    KMP_TRY(kmp_variant_new(o->model, o->count, (const char *const *)o->bounded.name, &given));
    for (int k = 0; k < o->count; k++) {
        const kempe_model *m = kmp_variant_model(given);
        o->start[k] = m->parameters[kmp_parameter_find(m, o->bounded.name[k])].number.value;
    }
    kmp_variant_free(given);
    if (file)
        KMP_TRY(kmp_bounded_read_start(o->context, file, &o->bounded, o->start));
    KMP_TRY(kmp_bounded_check(o->context, &o->bounded, o->start));
    const char *method = options->method;
    bool slopes = method ? strcmp(method, "slopes") == 0 : o->objective.runs != NULL;
    if (method && !slopes && strcmp(method, "values") != 0)
        return kmp_fail(o->context, KEMPE_E_ARGUMENT, "unknown method '%s'; available: slopes, values", method);
    if (slopes && !o->objective.runs)
        return kmp_fail(o->context, KEMPE_E_ARGUMENT, "there are no slopes: %s", o->objective.obstacle);
    o->method = slopes ? "slopes" : "values";
    return KEMPE_OK;
}

/* -- the object -------------------------------------------------------------------------------------- */

kempe_status kempe_optimum_new(const kempe_model *model, const kempe_optimum_options *options, kempe_optimum **optimum)
{
    KMP_WANTED_BOTH(model, optimum);
    KMP_OPTIONS(model->context, kempe_optimum_options, options);
    double begin = kmp_cpu_now();
    kmp_model_begin_forces(model);
    KMP_TRY(kmp_model_check_finished(model));
    KMP_MAKE(model->context, kempe_optimum, o);
    o->context = model->context;
    o->model = model;
    o->best = -1;
    kempe_status status = prepare(o, options);
    if (status == KEMPE_OK) {
        const bool quiet = kmp_context_quiet(o->context, true);
        status = search_all(o);
        (void)kmp_context_quiet(o->context, quiet);
    }
    bool given = status == KEMPE_OK || (status == KEMPE_STOPPED && o->variant);
    if (given) {
        const kmp_searched *s = &o->search[o->best];
        if (s->broken > KMP_OPTIMUM_KEPT)
            kmp_doubt(o->context,
                      "no place keeps all limits: the result is the one that breaks them least, by %.3g of a bound",
                      s->broken);
        if (s->outcome == KMP_SQUARES_MOST)
            kmp_doubt(o->context,
                      "the best search has not converged after %d evaluations: continue from its result, or allow more",
                      s->evaluations);
        status = kmp_context_verdict(o->context, status);
        o->seconds += kmp_cpu_now() - begin + o->objective.helped_s;
        o->warnings = kmp_context_warnings(o->context);
        o->reason = kmp_strdup(kmp_is_complete(status) ? "" : kempe_context_message(o->context));
        o->status = status;
    }
    if (!given || !o->warnings || !o->reason) {
        kempe_optimum_free(o);
        return given ? kmp_fail_memory(model->context) : status;
    }
    *optimum = o;
    return status;
}

void kempe_optimum_free(kempe_optimum *optimum)
{
    if (!optimum)
        return;
    kmp_objective_free(&optimum->objective);
    kmp_variant_free(optimum->variant);
    for (int k = 0; k < optimum->searches; k++) {
        kmp_free(optimum->search[k].tried);
        kmp_free(optimum->search[k].refusal);
    }
    kmp_free(optimum->reason);
    kmp_free(optimum->warnings);
    kmp_arena_free(&optimum->arena);
    kmp_free(optimum);
}

KMP_GETTER(int kempe_optimum_count(const kempe_optimum *optimum), optimum, optimum->count, 0)
KMP_GETTER_AT(const char *kempe_optimum_name(const kempe_optimum *optimum, int k), optimum, k, optimum->count,
              optimum->bounded.name[k], "")
KMP_GETTER_AT(double kempe_optimum_value(const kempe_optimum *optimum, int k), optimum, k, optimum->count,
              optimum->value[k], NAN)
KMP_GETTER(double kempe_optimum_quantity(const kempe_optimum *optimum), optimum, optimum->at_best[0], NAN)
KMP_GETTER(int kempe_optimum_is_kept(const kempe_optimum *optimum), optimum,
           optimum->search[optimum->best].broken <= KMP_OPTIMUM_KEPT, 0)
KMP_GETTER(const char *kempe_optimum_method(const kempe_optimum *optimum), optimum, optimum->method, "")
