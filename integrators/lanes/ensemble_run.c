/* SPDX-License-Identifier: BSD-3-Clause */
#include "integrators/lanes/ensemble_run.h"
#include "base/memory.h"
#include "constraints/rounding/mend.h"
#include "integrators/lanes/ensemble_inside.h"
#include <math.h>
#include <string.h>

/* -- making one -------------------------------------------------------------------------------------- */

static kempe_status make(kmp_ensemble *e, const kempe_model *model, const char *const *names)
{
    KMP_TRY(kmp_variant_new(model, e->columns, names, &e->variant));
    KMP_TRY(kmp_system_of_variant(e->variant, &e->s));
    e->n = e->s->n;
    e->m = e->r = e->s->m;
    e->p = e->n - e->m;
    e->size = e->n + e->p + e->s->dissipative;
    e->parameters = kmp_variant_model(e->variant)->parameter_count;
    e->unit_row_scale = KMP_NEW(double, e->m);
    KMP_TRY(kmp_made(e->context, e->unit_row_scale));
    memcpy(e->unit_row_scale, e->s->row_scale, (size_t)e->m * sizeof(double));
    return KEMPE_OK;
}

kempe_status kmp_ensemble_new(const kempe_model *model, int count, const char *const *names, kmp_ensemble **ensemble)
{
    KMP_MAKE(model->context, kmp_ensemble, e);
    e->context = model->context;
    e->columns = count;
    kempe_status status = make(e, model, names);
    return KMP_GIVE_OR_FREE(status, ensemble, e, kmp_ensemble_free);
}

void kmp_ensemble_free(kmp_ensemble *e)
{
    if (!e)
        return;
    kempe_system_free(e->s);
    kmp_variant_free(e->variant);
    kmp_free(e->unit_row_scale);
    kmp_free(e);
}

const kempe_system *kmp_ensemble_system(const kmp_ensemble *e)
{
    return e->s;
}

kmp_ensemble_work kmp_ensemble_get_work(const kmp_ensemble *e)
{
    return e->work;
}

/* -- a run ------------------------------------------------------------------------------------------- */

static void release(kmp_ensemble *e)
{
    for (int k = 0; k < e->pool_count; k++)
        kmp_pool_free(e->pools[k]);
    e->pool_count = 0;
    kmp_eval_free(e->eval);
    kmp_arena_free(&e->arena);
    e->eval = NULL;
}

static bool allocate(kmp_ensemble *e)
{
    kmp_arena *a = &e->arena;
    int size = e->size > 0 ? e->size : 0;
    e->state = KMP_ARENA_NEW(a, double, 4 * e->n);
    e->instances = KMP_ARENA_NEW(a, kmp_instance, e->count);
    for (int i = 0; i < e->count && !a->failed; i++) {
        kmp_instance *x = &e->instances[i];
        (void)KMP_ARENA_MAKE(a, KMP_ROOM(double, size, &x->y, &x->dy),
                             KMP_ROOM(double, e->parameters + e->n + e->m, &x->constants));
        (void)kmp_present_inputs_init(&x->inputs, a, e->s->model);
        x->inputs.held = true;
    }
    return !a->failed;
}

static kempe_status prepare(kmp_ensemble *e)
{
    int width = e->execution.width > 0 ? e->execution.width : kmp_lanes_best();
    e->eval = kmp_eval_new(e->s, "tape");
    if (!e->eval)
        return KEMPE_E_MEMORY;
    bool ok = allocate(e) && (kmp_ensemble_no_lanes(e) || kmp_lane_room_init(e, width));
    KMP_TRY(kmp_made(e->context, ok));
    for (int i = 0; i < e->count; i++)
        e->results[i] = (kmp_ensemble_result){.status = KEMPE_STOPPED, .h = NAN, .hdot = NAN, .drift = NAN};
    for (size_t k = 0; k < (size_t)e->count * (size_t)e->n; k++)
        e->q[k] = e->qd[k] = NAN;
    e->work = (kmp_ensemble_work){.width = width};
    return KEMPE_OK;
}

static kmp_pool *fullest(const kmp_ensemble *e)
{
    kmp_pool *pool = NULL;
    for (int k = 0; k < e->pool_count; k++)
        if (e->pools[k]->waiting > (pool ? pool->waiting : 0))
            pool = e->pools[k];
    return pool;
}

static kempe_status run_lanes(kmp_ensemble *e)
{
    kempe_status status = KEMPE_OK;
    kmp_pool *pool;
    for (int i = 0; i < e->count && status == KEMPE_OK && !kmp_interrupted(e->context); i++)
        status = kmp_instance_start(e, i);
    while (status == KEMPE_OK && !kmp_interrupted(e->context) && (pool = fullest(e)))
        status = kmp_pool_run(e, pool);
    e->work.pools = e->pool_count;
    e->work.native = e->pool_count > 0 && kmp_lanes_native(e->pools[0]->lanes);
    return status;
}

/* An instance still marked as stopped, but not by its own conditions, was interrupted. */
static kempe_status run_alone(kmp_ensemble *e)
{
    kempe_status status = KEMPE_OK;
    int count = 0, before = e->work.alone;
    for (int i = 0; i < e->count; i++)
        count += e->results[i].alone;
    for (int i = 0; i < e->count && status == KEMPE_OK; i++) {
        if (!e->results[i].alone)
            continue;
        if (kmp_interrupted(e->context))
            break;
        status = kmp_instance_alone(e, i);
        kmp_progress(e->context, KMP_PROGRESS_STUDY, ++e->work.alone - before, count, "instances");
    }
    for (int i = 0; i < e->count && status == KEMPE_OK; i++) {
        kmp_ensemble_result *result = &e->results[i];
        if (result->status == KEMPE_STOPPED && !result->reason && !(result->reason = kmp_strdup("interrupted")))
            status = kmp_fail_memory(e->context);
    }
    return status;
}

static kempe_status run_all(kmp_ensemble *e)
{
    const char *why = kmp_ensemble_no_lanes(e);
    KMP_TRY(prepare(e));
    if (!why)
        KMP_TRY(run_lanes(e));
    for (int i = 0; why && i < e->count; i++)
        kmp_instance_leave(e, i, why);
    return run_alone(e);
}

kempe_status kmp_ensemble_run(kmp_ensemble *e, const kmp_run_spec *spec, const kmp_ensemble_execution *execution,
                              int instances, const double *values, kmp_ensemble_result *results, double *q, double *qd)
{
    kmp_context_clear(e->context);
    e->spec = *spec;
    e->spec.threads = 0; /* one thread per instance */
    e->execution = *execution;
    e->count = instances;
    e->values = values;
    e->results = results;
    e->q = q;
    e->qd = qd;
    KMP_TRY(kmp_run_resolve(e->s, &e->spec));
    e->spec.open_integrator = false; /* an instance in lanes and one by itself have the same integrator */
    kmp_context_quiet(e->context, true);
    kempe_status status = run_all(e);
    kmp_context_quiet(e->context, false);
    release(e);
    if (status == KEMPE_OK)
        kmp_context_clear(e->context);
    for (int i = 0; status != KEMPE_OK && i < instances; i++) {
        kmp_free(results[i].reason);
        results[i].reason = NULL;
    }
    return status;
}
