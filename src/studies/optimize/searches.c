/* SPDX-License-Identifier: BSD-3-Clause */
#include "studies/optimize/searches.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "studies/fit/search_threads.h"
#include <math.h>
#include <string.h>

/* The evaluator of one thread. The first one is that of the caller and has its context. */
typedef struct searcher {
    kempe_optimum *o;
    kempe_context *context;
    kmp_variant *copy; /* the model, with this context */
    kmp_objective own, *objective;
    double *x, *values, *slopes; /* of a trial: in SI; of all quantities */
    kmp_searched *search;
    kempe_status status;
} searcher;

/* -- evaluations ------------------------------------------------------------------------------------- */

static double side(const kempe_optimum *o, int k)
{
    return o->bounded.upper[k] - o->bounded.lower[k];
}

void kmp_optimum_leave_cube(const kempe_optimum *optimum, const double *cube, double *x)
{
    const kmp_bounded *bounded = &optimum->bounded;
    for (int k = 0; k < optimum->count; k++)
        x[k] = fmin(fmax(bounded->lower[k] + side(optimum, k) * cube[k], bounded->lower[k]), bounded->upper[k]);
}

static double size_of_limit(const kmp_quantity_limit *limit)
{
    return limit->bound != 0 ? fabs(limit->bound) : 1;
}

double kmp_optimum_broken(const kempe_optimum *optimum, const double *values, double *limit)
{
    const kmp_quantity_list *list = optimum->objective.list;
    double most = 0;
    for (int k = 0; k < list->limit_count; k++) {
        const kmp_quantity_limit *l = &list->limit[k];
        double over = l->sign * (values[l->value] - l->bound) / size_of_limit(l);
        most = fmax(most, isnan(over) ? INFINITY : over);
        if (limit)
            limit[k] = over;
    }
    return most;
}

static bool note(kmp_searched *search, double value, double broken)
{
    kmp_trial *tried = kmp_list_room(search->tried, (size_t)search->tried_count, sizeof *tried);
    if (!tried)
        return false;
    search->tried = tried;
    tried[search->tried_count++] = (kmp_trial){value, broken};
    return true;
}

static void give_slopes(const searcher *w, double *slope, double *limit_slope)
{
    const kempe_optimum *o = w->o;
    const kmp_quantity_list *list = o->objective.list;
    double sign = o->most_wanted ? -1 : 1;
    for (int k = 0; k < o->count; k++)
        slope[k] = sign * w->slopes[k] * side(o, k);
    for (int l = 0; l < list->limit_count; l++) {
        const kmp_quantity_limit *limit = &list->limit[l];
        for (int k = 0; k < o->count; k++)
            limit_slope[l * o->count + k] =
                limit->sign * w->slopes[(ptrdiff_t)limit->value * o->count + k] * side(o, k) / size_of_limit(limit);
    }
}

static kmp_squares_said try(void *user, const double *cube, double *value, double *slope, double *limit,
                            double *limit_slope)
{
    searcher *w = user;
    const kempe_optimum *o = w->o;
    bool slopes = strcmp(o->method, "slopes") == 0;
    kmp_optimum_leave_cube(o, cube, w->x);
    kmp_progress(w->context, KMP_PROGRESS_STUDY, w->search->number, o->starts, "searches");
    w->status = slopes ? kmp_objective_slopes(w->objective, w->x, w->values, w->slopes)
                       : kmp_objective_values(w->objective, 1, w->x, w->values);
    if (w->status != KEMPE_OK)
        return KMP_SQUARES_END;
    if (!note(w->search, w->values[0], kmp_optimum_broken(o, w->values, NULL))) {
        w->status = kmp_fail_memory(w->context);
        return KMP_SQUARES_END;
    }
    if (isnan(w->values[0]))
        return KMP_SQUARES_NOWHERE;
    *value = o->most_wanted ? -w->values[0] : w->values[0];
    double broken = kmp_optimum_broken(o, w->values, limit);
    if (slopes)
        give_slopes(w, slope, limit_slope);
    return isfinite(broken) ? KMP_SQUARES_GO : KMP_SQUARES_NOWHERE;
}

/* -- one thread -------------------------------------------------------------------------------------- */

/* The caller's objective exists; another thread derives its equations anew, in a context of its own. */
static kempe_status begin_searcher(void *self, void *job, kempe_context *context, bool caller)
{
    searcher *w = self;
    kempe_optimum *o = job;
    const int width = o->objective.list->run.values;
    const char *const *names = (const char *const *)o->bounded.name;
    w->o = o;
    w->context = context;
    w->x = KMP_NEW(double, o->count);
    w->values = KMP_NEW(double, width);
    w->slopes = KMP_NEW(double, (ptrdiff_t)width * o->count);
    if (!w->x || !w->values || !w->slopes)
        return KEMPE_E_MEMORY;
    if (caller) {
        w->objective = &o->objective;
        return KEMPE_OK;
    }
    KMP_TRY(kmp_variant_new_in(w->context, o->model, 0, NULL, &w->copy));
    KMP_TRY(kmp_objective_init(&w->own, kmp_variant_model(w->copy), o->count, names, o->quantity, o->limit_words,
                               &o->objective.run));
    w->objective = &w->own;
    return KEMPE_OK;
}

static void end_searcher(void *self)
{
    searcher *w = self;
    if (w->objective == &w->own) {
        w->o->objective.simulations += w->own.simulations;
        kmp_objective_free(&w->own);
    }
    kmp_variant_free(w->copy);
    kmp_free(w->x);
    kmp_free(w->values);
    kmp_free(w->slopes);
}

static kempe_status search_from(void *self, int number)
{
    searcher *w = self;
    const kempe_optimum *o = w->o;
    kmp_searched *s = &w->o->search[number];
    const kmp_minimum minimum = {.count = o->count,
                                 .limits = o->limits,
                                 .slopes = strcmp(o->method, "slopes") == 0,
                                 .tolerance = o->tolerance,
                                 .kept = KMP_OPTIMUM_KEPT,
                                 .most = o->most,
                                 .at = try,
                                 .user = w};
    kmp_minimum_report report = {0};
    w->search = s;
    s->begun = true;
    if (!kmp_minimum_find(&minimum, s->x, &report))
        w->status = kmp_fail_memory(w->context);
    kmp_optimum_leave_cube(o, s->x, s->x);
    s->value = report.value;
    s->broken = report.broken;
    s->evaluations = report.evaluations;
    s->refused = report.refused + (report.outcome == KMP_SQUARES_NO_START);
    s->outcome = report.outcome;
    if (s->refused > 0 && w->objective->refusal && !(s->refusal = kmp_strdup(w->objective->refusal)))
        w->status = kmp_fail_memory(w->context);
    return w->status;
}

/* -- all searches ------------------------------------------------------------------------------------ */

static bool is_better(const kmp_searched *a, const kmp_searched *b)
{
    bool kept = a->broken <= KMP_OPTIMUM_KEPT, other = b->broken <= KMP_OPTIMUM_KEPT;
    return kept && other ? a->value < b->value : a->broken < b->broken;
}

kempe_status kmp_searches_run(kempe_optimum *optimum, int count)
{
    static const kmp_searcher_kind kind = {sizeof(searcher), begin_searcher, search_from, end_searcher};
    kempe_optimum *o = optimum;
    kempe_status status = kmp_share_searches(o->context, &kind, o, o->threads, count, &o->seconds);
    /* Keeps the searches that have begun, in the order of their starts. */
    for (int k = 0; k < count; k++) {
        if (!o->search[k].begun)
            continue;
        const kmp_searched *s = &o->search[o->searches];
        o->search[o->searches] = o->search[k];
        o->evaluations += s->evaluations;
        o->refused += s->refused;
        if (s->outcome != KMP_SQUARES_NO_START && (o->best < 0 || is_better(s, &o->search[o->best])))
            o->best = o->searches;
        o->searches++;
    }
    return status;
}
