/* SPDX-License-Identifier: BSD-3-Clause */
/* Instances are ordered by the values that shape equations; instances with the same values form a group, which one
 * mechanism runs in its lanes. */
#include "ensemble/mechanisms.h"
#include "base/context.h"
#include "base/memory.h"
#include "ensemble/sampling/model_instances.h"
#include "model/data/model_context.h"
#include "model/data/run_settings.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Mechanisms that stay for the next part of a run. */
enum { KEPT = 16 };

typedef struct mechanism {
    double *shape; /* values of the shaping parameters */
    kempe_model *model;
    kmp_quantity_list quantities;
    kmp_ensemble *inner; /* NULL: the model cannot have these values */
    char *reason;
    long used; /* the last time */
} mechanism;

struct kmp_mechanisms {
    const kempe_model *model;
    const kmp_quantity_list *quantities;
    kmp_ensemble *base;
    kmp_arena arena;
    int columns, shaping, others; /* of the columns of values: parameters that shape equations, and the others, */
    int *column;                  /* in this order */
    const char **name;            /* in this order, too */
    mechanism kept[KEPT];
    int kept_count;
    long clock;
    kmp_ensemble_work work;
};

/* -- construction ------------------------------------------------------------------------------------- */

static const kempe_model *measured(const kempe_model *model, const kmp_quantity_list *list)
{
    return list->variant ? kmp_variant_model(list->variant) : model;
}

kempe_status kmp_mechanisms_new(const kempe_model *model, int count, const char *const *names,
                                const kmp_quantity_list *quantities, kmp_mechanisms **mechanisms)
{
    KMP_MAKE(kmp_model_context(model), kmp_mechanisms, m);
    m->model = model;
    m->quantities = quantities;
    m->columns = count;
    kempe_status status = kmp_made(kmp_model_context(model), KMP_ARENA_MAKE(&m->arena, KMP_ROOM(int, count, &m->column),
                                                                            KMP_ROOM(const char *, count, &m->name)));
    if (status == KEMPE_OK) {
        /* The columns that shape the mechanism come first. */
        for (int pass = 0; pass < 2; pass++)
            for (int k = 0; k < m->columns; k++) {
                const bool shapes = kmp_instance_reads(m->model, names[k]);
                if (shapes == (pass == 1))
                    continue;
                const int at = m->shaping + m->others;
                m->column[at] = k;
                m->name[at] = names[k];
                *(shapes ? &m->shaping : &m->others) += 1;
            }
        status = kmp_ensemble_new(measured(model, quantities), m->others, m->name + m->shaping, &m->base);
    }
    return KMP_GIVE_OR_FREE(status, mechanisms, m, kmp_mechanisms_free);
}

static void empty(mechanism *one)
{
    kmp_ensemble_free(one->inner);
    kmp_quantity_list_free(&one->quantities);
    kempe_model_free(one->model);
    kmp_free(one->reason);
    kmp_free(one->shape);
    *one = (mechanism){0};
}

void kmp_mechanisms_free(kmp_mechanisms *m)
{
    if (!m)
        return;
    for (int k = 0; k < m->kept_count; k++)
        empty(&m->kept[k]);
    kmp_ensemble_free(m->base);
    kmp_arena_free(&m->arena);
    kmp_free(m);
}

const kempe_system *kmp_mechanisms_system(const kmp_mechanisms *m)
{
    return kmp_ensemble_system(m->base);
}

kmp_ensemble_work kmp_mechanisms_get_work(const kmp_mechanisms *m)
{
    return m->work;
}

/* -- one mechanism ------------------------------------------------------------------------------------ */

/* Settings of the run are the same for all instances. */
static const char *other_setting(const kempe_model *a, const kempe_model *b)
{
    const kmp_run_settings *x = kmp_model_run(a), *y = kmp_model_run(b);
#define KMP_RUN_OPTION(name, type, key, ...)                                                                           \
    KMP_RUN_IF_KEY_##key(KMP_RUN_IF_NUMBER_##type(if (x->name != y->name) return #name;))
#include "model/data/run_options.def"
#undef KMP_RUN_OPTION
    return NULL;
}

static kempe_status derive(const kmp_mechanisms *m, mechanism *one)
{
    const kmp_quantity_list *list = m->quantities;
    const char *other = other_setting(m->model, one->model);
    if (other)
        return kmp_fail(kmp_model_context(m->model), KEMPE_E_FAILED,
                        "the setting '%s' of run differs from the other instances", other);
    KMP_TRY(kmp_quantity_list_init(&one->quantities, one->model, list->words, list->limit_words));
    const kempe_model *model = measured(one->model, &one->quantities);
    KMP_TRY(kmp_ensemble_new(model, m->others, m->name + m->shaping, &one->inner));
    if (kmp_ensemble_system(one->inner)->n != kmp_mechanisms_system(m)->n)
        return kmp_fail(kmp_model_context(m->model), KEMPE_E_FAILED,
                        "the number of coordinates is another one with these values");
    return KEMPE_OK;
}

static kempe_status make(const kmp_mechanisms *m, const double *shape, mechanism *one)
{
    kempe_context *context = kmp_model_context(m->model);
    one->shape = KMP_NEW(double, m->shaping);
    KMP_TRY(kmp_made(context, one->shape));
    memcpy(one->shape, shape, (size_t)m->shaping * sizeof *shape);
    kempe_status status = kmp_model_read_again(m->model, m->shaping, m->name, shape, &one->model);
    if (status == KEMPE_OK) {
        status = derive(m, one);
        status = status == KEMPE_E_INPUT || status == KEMPE_E_ARGUMENT ? KEMPE_E_FAILED : status;
    }
    if (status != KEMPE_E_FAILED)
        return status;
    kmp_ensemble_free(one->inner);
    one->inner = NULL;
    one->reason = kmp_strdup(kempe_context_message(context));
    if (one->reason)
        one->reason[strcspn(one->reason, "\n")] = 0; /* its first line */
    kmp_context_clear(context);
    return kmp_made(context, one->reason);
}

/* The mechanism with these values, kept or made in the place of the one that was not used for longest. */
static kempe_status take(kmp_mechanisms *m, const double *shape, mechanism **found)
{
    int at = 0;
    *found = NULL;
    for (int k = 0; k < m->kept_count && !*found; k++) {
        at = m->kept[k].used < m->kept[at].used ? k : at;
        if (memcmp(m->kept[k].shape, shape, (size_t)m->shaping * sizeof *shape) == 0)
            *found = &m->kept[k];
    }
    if (!*found) {
        mechanism *one = &m->kept[m->kept_count < KEPT ? m->kept_count++ : at];
        empty(one);
        const bool quiet = kmp_context_quiet(kmp_model_context(m->model), true);
        kempe_status status = make(m, shape, one);
        (void)kmp_context_quiet(kmp_model_context(m->model), quiet);
        if (status != KEMPE_OK) { /* the last one takes its place */
            empty(one);
            mechanism *last = &m->kept[--m->kept_count];
            if (last != one)
                *one = *last;
            *last = (mechanism){0};
            return status;
        }
        *found = one;
    }
    (*found)->used = ++m->clock;
    return KEMPE_OK;
}

/* -- a run -------------------------------------------------------------------------------------------- */

typedef struct grouped_run {
    kmp_mechanisms *m;
    const kmp_run_spec *spec;
    const kmp_ensemble_execution *execution;
    int instances, done;
    const double *values;
    kmp_ensemble_result *results;
    double *q, *qd;
    /* Of the instances of a group: */
    double *row, *group_q, *group_qd, *taken;
    kmp_ensemble_result *result;
} grouped_run;

/* A key: the number of shaping values, these, and the number of the instance. */
static int compare_keys(const void *a, const void *b)
{
    const double *x = a, *y = b;
    const int size = 2 + (int)x[0];
    for (int k = 1; k < size; k++)
        if (x[k] != y[k])
            return x[k] < y[k] ? -1 : 1;
    return 0;
}

static double *make_keys(const grouped_run *r, kmp_arena *arena)
{
    const kmp_mechanisms *m = r->m;
    const int size = m->shaping + 2;
    double *keys = KMP_ARENA_NEW(arena, double, (ptrdiff_t)size * r->instances);
    for (int i = 0; keys && i < r->instances; i++) {
        double *key = keys + (ptrdiff_t)i * size;
        key[0] = m->shaping;
        for (int k = 0; k < m->shaping; k++)
            key[1 + k] = r->values[(ptrdiff_t)i * m->columns + m->column[k]];
        key[1 + m->shaping] = i;
    }
    if (keys)
        qsort(keys, (size_t)r->instances, (size_t)size * sizeof *keys, compare_keys);
    return keys;
}

static void copy_numbers(double *to, const double *from, int count)
{
    if (count > 0)
        memcpy(to, from, (size_t)count * sizeof *to);
}

static kempe_status run_group(grouped_run *r, int count, const double *keys, mechanism *one)
{
    kmp_mechanisms *m = r->m;
    const int n = kmp_mechanisms_system(m)->n, values = m->quantities->run.values, size = m->shaping + 2;
    kmp_ensemble_execution execution = *r->execution;
    for (int k = 0; k < count; k++) {
        const double *row = r->values + (ptrdiff_t)keys[(ptrdiff_t)k * size + size - 1] * m->columns;
        for (int c = 0; c < m->others; c++)
            r->row[(ptrdiff_t)k * m->others + c] = row[m->column[m->shaping + c]];
    }
    execution.quantities = r->execution->taken ? &one->quantities.run : NULL;
    execution.taken = r->taken;
    execution.starts = NULL;
    execution.before += r->done;
    execution.total = execution.total != 0 ? execution.total : r->instances;
    KMP_TRY(kmp_ensemble_run(one->inner, r->spec, &execution, count, r->row, r->result, r->group_q, r->group_qd));
    for (int k = 0; k < count; k++) {
        const int i = (int)keys[(ptrdiff_t)k * size + size - 1];
        r->results[i] = r->result[k];
        copy_numbers(r->q + (ptrdiff_t)i * n, r->group_q + (ptrdiff_t)k * n, n);
        copy_numbers(r->qd + (ptrdiff_t)i * n, r->group_qd + (ptrdiff_t)k * n, n);
        if (r->execution->taken)
            copy_numbers(r->execution->taken + (ptrdiff_t)i * values, r->taken + (ptrdiff_t)k * values, values);
    }
    const kmp_ensemble_work work = kmp_ensemble_get_work(one->inner);
    kmp_ensemble_work *sum = &m->work;
    sum->threads = work.threads > sum->threads ? work.threads : sum->threads;
    sum->width = work.width > sum->width ? work.width : sum->width;
    sum->pools += work.pools;
    sum->alone += work.alone;
    sum->cpu_s += work.cpu_s;
    sum->wall_s += work.wall_s;
    sum->native = sum->native || work.native;
    sum->doubted = sum->doubted || work.doubted;
    sum->sweeps += work.sweeps;
    sum->lane_steps += work.lane_steps;
    return KEMPE_OK;
}

static kempe_status leave(const grouped_run *r, int count, const double *keys, kempe_status status, const char *reason)
{
    const int size = r->m->shaping + 2;
    bool made = true;
    for (int k = 0; k < count && made; k++) {
        kmp_ensemble_result *result = &r->results[(int)keys[(ptrdiff_t)k * size + size - 1]];
        result->status = status;
        made = (result->reason = kmp_strdup(reason));
    }
    return kmp_made(kmp_model_context(r->m->model), made);
}

static kempe_status run_groups(grouped_run *r, const double *keys)
{
    kmp_mechanisms *m = r->m;
    const int size = m->shaping + 2;
    kempe_status status = KEMPE_OK;
    for (int from = 0, to = 0; status == KEMPE_OK && from < r->instances; from = to) {
        const double *key = keys + (ptrdiff_t)from * size;
        mechanism *one = NULL;
        while (to < r->instances &&
               memcmp(key, keys + (ptrdiff_t)to * size, (size_t)(m->shaping + 1) * sizeof *key) == 0)
            to++;
        if (kmp_interrupted(kmp_model_context(m->model)))
            return leave(r, r->instances - from, key, KEMPE_STOPPED, "interrupted");
        status = take(m, key + 1, &one);
        if (status == KEMPE_OK)
            status =
                one->inner ? run_group(r, to - from, key, one) : leave(r, to - from, key, KEMPE_E_INPUT, one->reason);
        r->done = to;
    }
    return status;
}

static void clear_results(const grouped_run *r)
{
    const ptrdiff_t n = kmp_mechanisms_system(r->m)->n, values = r->m->quantities->run.values;
    for (int i = 0; i < r->instances; i++)
        r->results[i] = (kmp_ensemble_result){.status = KEMPE_STOPPED, .h = NAN, .hdot = NAN, .drift = NAN};
    for (ptrdiff_t k = 0; k < r->instances * n; k++)
        r->q[k] = r->qd[k] = NAN;
    for (ptrdiff_t k = 0; r->execution->taken && k < r->instances * values; k++)
        r->execution->taken[k] = NAN;
}

static kempe_status run_shaped(grouped_run *r)
{
    const kmp_mechanisms *m = r->m;
    const ptrdiff_t many = r->instances, n = kmp_mechanisms_system(m)->n;
    kmp_arena arena = {0};
    double *keys = make_keys(r, &arena);
    bool made = keys && KMP_ARENA_MAKE(&arena, KMP_ROOM(double, many * m->others + 1, &r->row),
                                       KMP_ROOM(double, many *n, &r->group_q, &r->group_qd),
                                       KMP_ROOM(double, many * m->quantities->run.values + 1, &r->taken),
                                       KMP_ROOM(kmp_ensemble_result, many, &r->result));
    kempe_status status = kmp_made(kmp_model_context(m->model), made);
    clear_results(r);
    if (status == KEMPE_OK)
        status = run_groups(r, keys);
    for (int i = 0; status != KEMPE_OK && i < r->instances; i++) {
        kmp_free(r->results[i].reason);
        r->results[i].reason = NULL;
    }
    kmp_arena_free(&arena);
    return status;
}

kempe_status kmp_mechanisms_run(kmp_mechanisms *m, const kmp_run_spec *spec, const kmp_ensemble_execution *execution,
                                int instances, const double *values, kmp_ensemble_result *results, double *q,
                                double *qd)
{
    grouped_run r = {.m = m,
                     .spec = spec,
                     .execution = execution,
                     .instances = instances,
                     .values = values,
                     .results = results,
                     .q = q,
                     .qd = qd};
    kmp_ensemble_execution whole = *execution;
    m->work = (kmp_ensemble_work){0};
    if (m->shaping > 0)
        return run_shaped(&r);
    whole.quantities = execution->taken ? &m->quantities->run : NULL;
    kempe_status status = kmp_ensemble_run(m->base, spec, &whole, instances, values, results, q, qd);
    m->work = kmp_ensemble_get_work(m->base);
    return status;
}
