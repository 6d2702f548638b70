/* SPDX-License-Identifier: BSD-3-Clause */
/* Impacts, changes of modes and of closures, and samples of states happen to an instance between two of its steps. It
 * stands at the site of its engine, a run that makes no steps, where all this is decided as in any run. It goes on
 * in lanes, with other conditions and perhaps other rows. */
#include "ensemble/lanes/lane_events.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "ensemble/lanes/ensemble_apart.h"
#include "ensemble/lanes/ensemble_conditions.h"
#include "ensemble/lanes/ensemble_engine.h"
#include "ensemble/lanes/ensemble_inside.h"
#include "ensemble/lanes/ensemble_start.h"
#include "ensemble/lanes/ensemble_within.h"
#include "integrators/decide/restart.h"
#include "integrators/run/runner_change.h"
#include "integrators/run/runner_start.h"
#include "integrators/run/sampler.h"
#include "model/data/model.h"
#include <math.h>
#include <string.h>

kempe_status kmp_site_init(kmp_engine *e)
{
    const kempe_system *s = e->s;
    bool any = s->switches || s->load_row_count > 0 || kmp_model_has_samples(s->model) || kmp_has_late_conditions(s);
    for (int k = 0; k < s->events.count; k++)
        any = any || s->events.condition[k].role != KMP_ROLE_NONE;
    if (!any)
        return KEMPE_OK;
    KMP_TRY(kmp_runner_site_new(e->eval, &e->spec, &e->site));
    e->fresh = KMP_ARENA_NEW(&e->run_arena, char, kmp_runner_memory_size(e->s) + 1);
    KMP_TRY(kmp_made(e->context, e->fresh));
    kmp_runner_keep_memory(e->site, e->fresh);
    return KEMPE_OK;
}

/* Takes what an instance has after its stand. */
static void depart(kmp_engine *e, kmp_instance *x)
{
    kmp_runner_keep_memory(e->site, x->memory);
    x->next_sample = kmp_runner_next_sample(e->site);
    if (e->conditions)
        kmp_instance_keep_modes(e, x);
    if (e->eval->nu)
        memcpy(x->nu, e->eval->nu, (size_t)e->m * sizeof *x->nu);
    kmp_present_inputs_copy(&x->inputs, &e->eval->inputs);
    e->site->crossing = NULL;
}

kempe_status kmp_instance_restart(kmp_engine *e, kmp_instance *x, const kempe_assembly *a)
{
    kmp_runner *site = e->site;
    kmp_runner_take_memory(site, e->fresh, false);
    site->spec.inputs_start = &x->inputs;
    site->rate_scale = 0;
    kempe_status status = kmp_runner_begin_at(site, a);
    if (status == KEMPE_OK)
        depart(e, x);
    x->stood = status == KEMPE_OK;
    kmp_engine_hold_inputs(e, NULL);
    return status;
}

/* The rows of the site become those of a pool. */
static kempe_status take_rows(kmp_engine *e, const kmp_lane_group *from, double t)
{
    kmp_runner *site = e->site;
    kmp_partition_free(&site->part);
    KMP_TRY(kmp_made(e->context, kmp_partition_copy(&site->part, &from->part)));
    if (!e->s->switches)
        return KEMPE_OK;
    kmp_rank_margin_free(&site->margin);
    return kmp_runner_compute_margin(site, t, site->state);
}

/* Goes on in lanes, or in a separate run, from the site. */
static kempe_status go_on(kmp_engine *e, const kmp_lane_group *from, int i, double work)
{
    kmp_instance *x = &e->instances[i];
    kmp_runner *site = e->site;
    kmp_partition part;
    double limit = x->limit;
    memcpy(e->state, site->state, 2 * (size_t)e->n * sizeof *e->state);
    if (kmp_friction_is_smooth(site->friction))
        return kmp_instance_start_apart(e, i, site->part.r, 0, e->state, e->state + e->n, work, KMP_LANE_SMOOTH);
    KMP_TRY(kmp_made(e->context, kmp_partition_copy(&part, e->s->switches ? &site->part : &from->part)));
    if (e->s->switches)
        x->usual = part.r > 0 ? part.pivots[part.r - 1] : 1;
    if (e->s->dissipative)
        x->y[e->n + part.p] = work;
    x->seen_t = x->corrected.t = -1;
    kmp_eval_closure(e->eval, x->t, e->state);
    KMP_TRY(kmp_instance_go_on(e, i, KEMPE_OK, &part, e->state, e->state + e->n));
    x->limit = e->s->switches ? x->limit : limit;
    return KEMPE_OK;
}

kempe_status kmp_instance_pass(kmp_engine *e, kmp_lane_group *from, int i, bool event, double since)
{
    kmp_instance *x = &e->instances[i];
    kmp_runner *site = e->site;
    double work, before = e->s->dissipative ? x->y[e->n + from->part.p] : 0;
    memcpy(site->state, e->state, 2 * (size_t)e->n * sizeof *site->state);
    site->crossing = kmp_instance_crossing(e, x);
    site->rate_scale = x->rate_scale;
    kempe_status status = kmp_instance_take_values(e, i); /* impacts have those of the model */
    kmp_constants_take(e->s, &x->constants);
    kmp_runner_take_memory(site, x->memory, false);
    if (status == KEMPE_OK)
        status = take_rows(e, from, x->t);
    if (status == KEMPE_OK)
        status = kmp_runner_pass_here(site, x->t, event, &work);
    if (status == KEMPE_OK)
        depart(e, x);
    if (event && e->s->switches) { /* pass_switch of runner_change.c */
        x->h = kmp_restart_length(x->h, since, KMP_FRICTION_INSTANT * e->spec.t_end, kmp_impact_since(site->impacts));
        x->has_step = x->h > 0;
    }
    kmp_engine_hold_inputs(e, NULL);
    if (status == KEMPE_OK)
        return go_on(e, from, i, before + work);
    kmp_free(site->reason);
    site->reason = NULL;
    site->ended = false;
    if (status != KEMPE_E_FAILED && status != KEMPE_STOPPED)
        return status;
    kmp_context_clear(e->context);
    kmp_instance_leave(e, i, "an event that a lane cannot pass"); /* a run from the start says why */
    return KEMPE_OK;
}

kempe_status kmp_instance_meet(kmp_engine *e, kmp_lane_group *from, int i)
{
    if (!kmp_instance_unpack(e, from, i, true))
        return KEMPE_OK;
    kmp_engine_hold_inputs(e, &e->instances[i].inputs);
    return kmp_instance_pass(e, from, i, false, 0);
}
