/* SPDX-License-Identifier: BSD-3-Clause */
/* An engine: the instances of one thread. Its pools stay from one chunk of a run to the next. */
#include "ensemble/lanes/ensemble_engine.h"
#include "base/memory.h"
#include "constraints/inexact/nearest_exact.h"
#include "dynamics/motion.h"
#include "ensemble/lanes/ensemble_apart.h"
#include "ensemble/lanes/ensemble_conditions.h"
#include "ensemble/lanes/ensemble_inside.h"
#include "ensemble/lanes/ensemble_lanes.h"
#include "ensemble/lanes/ensemble_measure.h"
#include "ensemble/lanes/ensemble_start.h"
#include "ensemble/lanes/ensemble_within.h"
#include "ensemble/lanes/lane_events.h"
#include "ensemble/lanes/lane_group.h"
#include "ensemble/lanes/lane_state.h"
#include "integrators/run/runner_site.h"
#include "model/data/model.h"
#include <math.h>
#include <string.h>

/* -- constants --------------------------------------------------------------------------------------- */

void kmp_constants_keep(const kempe_system *s, kmp_system_constants *constants)
{
    int parameters = s->model->parameter_count;
    memcpy(constants->numbers, s->parameters, (size_t)parameters * sizeof(double));
    memcpy(constants->numbers + parameters, s->scale, (size_t)s->n * sizeof(double));
    memcpy(constants->numbers + parameters + s->n, s->row_scale, (size_t)s->m * sizeof(double));
    constants->length = s->length;
    constants->reach = s->reach;
}

void kmp_constants_take(kempe_system *s, const kmp_system_constants *constants)
{
    int parameters = s->model->parameter_count;
    memcpy(s->parameters, constants->numbers, (size_t)parameters * sizeof(double));
    memcpy(s->scale, constants->numbers + parameters, (size_t)s->n * sizeof(double));
    memcpy(s->row_scale, constants->numbers + parameters + s->n, (size_t)s->m * sizeof(double));
    s->length = constants->length;
    s->reach = constants->reach;
}

/* -- making one -------------------------------------------------------------------------------------- */

static kempe_status make(kmp_engine *e, const kempe_model *model, const char *const *names, bool apart)
{
    e->context = apart ? kmp_context_new_below(model->context) : model->context;
    e->own_context = apart;
    if (!e->context)
        return KEMPE_E_MEMORY;
    KMP_TRY(kmp_variant_new_in(e->context, model, e->columns, names, &e->variant));
    KMP_TRY(kmp_system_of_variant(e->variant, &e->s));
    e->n = e->s->n;
    e->m = e->s->m;
    e->parameters = kmp_variant_model(e->variant)->parameter_count;
    e->own.numbers = KMP_NEW(double, e->parameters + e->n + e->m);
    KMP_TRY(kmp_made(e->context, e->own.numbers));
    kmp_constants_keep(e->s, &e->own);
    return KEMPE_OK;
}

kempe_status kmp_engine_new(const kempe_model *model, int count, const char *const *names, bool apart,
                            kmp_engine **engine)
{
    KMP_MAKE(model->context, kmp_engine, e);
    e->columns = count;
    kempe_status status = make(e, model, names, apart);
    return KMP_GIVE_OR_FREE(status, engine, e, kmp_engine_free);
}

void kmp_engine_free(kmp_engine *e)
{
    if (!e)
        return;
    kempe_system_free(e->s);
    kmp_variant_free(e->variant);
    kmp_free(e->own.numbers);
    if (e->own_context)
        kempe_context_free(e->context);
    kmp_free(e);
}

/* -- a run ------------------------------------------------------------------------------------------- */

static bool make_lanes(kmp_engine *e, int width)
{
    kmp_partition *part = &e->swapped;
    *part = (kmp_partition){.n = e->n, .m = e->m};
    if (!KMP_ARENA_MAKE(&e->run_arena, KMP_ROOM(int, 2 * (e->n + e->m), &part->u),
                        KMP_ROOM(double, e->n + e->m, &part->pivots)))
        return false;
    part->v = part->u + e->n; /* in one block, as in any partition */
    part->rows = part->v + e->n;
    part->redundant = part->rows + e->m;
    return kmp_lane_state_init(e, width) && kmp_within_init(e) && kmp_conditions_init(e);
}

kempe_status kmp_engine_begin(kmp_engine *e, const kmp_run_spec *spec, const kmp_ensemble_execution *execution,
                              kmp_ensemble_done *all)
{
    int width = execution->width;
    KMP_TRY(kmp_motion_need_bodies(e->s));
    e->spec = *spec;
    e->execution = *execution;
    e->all = all;
    e->work = (kmp_ensemble_work){.width = width};
    e->eval = kmp_eval_new(e->s, "tape");
    e->state = KMP_ARENA_NEW(&e->run_arena, double, 4 * e->n);
    bool lanes = !kmp_engine_no_lanes(e), ok = e->eval && e->state && (!lanes || make_lanes(e, width));
    KMP_TRY(kmp_made(e->context, ok && kmp_measuring_init(e)));
    return lanes ? kmp_site_init(e) : KEMPE_OK;
}

void kmp_engine_end(kmp_engine *e)
{
    for (int k = 0; k < e->pool_count; k++)
        kmp_lane_group_free(e->pools[k]);
    kmp_free(e->pools);
    e->pools = NULL;
    e->pool_count = 0;
    for (int k = 0; k < 2; k++) {
        kmp_lanes_free(e->beside[k]);
        e->beside[k] = NULL;
    }
    kmp_runner_site_free(e->site);
    e->site = NULL;
    e->measuring = NULL;
    e->conditions = NULL;
    kmp_eval_free(e->eval);
    kmp_arena_free(&e->run_arena);
    e->eval = NULL;
    kmp_constants_take(e->s, &e->own);
}

void kmp_engine_count(kmp_engine *e)
{
    long done = atomic_fetch_add_explicit(&e->all->done, 1, memory_order_relaxed) + 1;
    if (e->all->total > 0)
        kmp_progress(e->context, KMP_PROGRESS_STUDY, (double)done, (double)e->all->total, "instances");
}

/* -- a chunk ----------------------------------------------------------------------------------------- */

static kmp_lane_group *fullest(const kmp_engine *e)
{
    kmp_lane_group *pool = NULL;
    for (int k = 0; k < e->pool_count; k++)
        if (e->pools[k]->waiting > (pool ? pool->waiting : 0))
            pool = e->pools[k];
    return pool;
}

static kempe_status run_lanes(kmp_engine *e)
{
    kempe_status status = KEMPE_OK;
    kmp_lane_group *pool;
    for (int i = 0; i < e->count && status == KEMPE_OK && !kmp_interrupted(e->context); i++)
        status = kmp_instance_start(e, i);
    while (status == KEMPE_OK && !kmp_interrupted(e->context) && (pool = fullest(e)))
        status = kmp_lane_group_run(e, pool);
    for (int k = 0; k < e->pool_count; k++)
        while (kmp_lane_group_take(e, e->pools[k]) >= 0)
            ; /* those that an interrupt has left */
    e->work.native = e->pool_count > 0 && kmp_lanes_native(e->pools[0]->lanes);
    return status;
}

/* An instance still marked as stopped, but not by its own conditions, was interrupted. */
static kempe_status run_alone(kmp_engine *e)
{
    kempe_status status = KEMPE_OK;
    for (int i = 0; i < e->count && status == KEMPE_OK && !kmp_interrupted(e->context); i++)
        if (e->results[i].alone) {
            status = kmp_instance_alone(e, i);
            e->work.alone++;
            kmp_engine_count(e);
        }
    return status;
}

kempe_status kmp_engine_run(kmp_engine *e, int count, const double *values, kmp_ensemble_result *results, double *q,
                            double *qd)
{
    const char *why = kmp_engine_no_lanes(e);
    e->count = count;
    e->values = values;
    e->results = results;
    e->q = q;
    e->qd = qd;
    /* Room of all instances. */
    kmp_arena *a = &e->arena;
    int size = kmp_lane_most(e), events = e->s->events.count;
    size_t memory = e->site ? kmp_runner_memory_size(e->s) : 0;
    e->instances = KMP_ARENA_NEW(a, kmp_instance, e->count);
    for (int i = 0; i < e->count && !a->failed; i++) {
        kmp_instance *x = &e->instances[i];
        (void)KMP_ARENA_MAKE(a, KMP_ROOM(double, size, &x->y, &x->dy), KMP_ROOM(double, events, &x->mode),
                             KMP_ROOM(kmp_condition_past, events, &x->past),
                             KMP_ROOM(double, e->s->changes_by_rates ? e->n + e->m : 0, &x->vdd),
                             KMP_ROOM(double, e->s->load_row_count > 0 ? e->m : 0, &x->nu),
                             KMP_ROOM(double, e->parameters + e->n + e->m, &x->constants.numbers));
        (void)kmp_present_inputs_init(&x->inputs, a, e->s->model);
        x->inputs.held = true;
        x->memory = KMP_ARENA_NEW(a, double, (memory + sizeof(double) - 1) / sizeof(double) + 1);
        x->next_sample = INFINITY;
    }
    kempe_status status = kmp_made(e->context, !a->failed && kmp_measuring_chunk(e));
    for (int i = 0; status == KEMPE_OK && why && i < count; i++)
        kmp_instance_leave(e, i, why);
    if (status == KEMPE_OK && !why)
        status = run_lanes(e);
    if (status == KEMPE_OK)
        status = run_alone(e);
    kmp_arena_free(&e->arena);
    return status;
}
