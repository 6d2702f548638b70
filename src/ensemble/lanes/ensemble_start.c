/* SPDX-License-Identifier: BSD-3-Clause */
/* Operations on one instance at a time: its start, an exchange of u, its end. The evaluator and the scales of the
 * system are those of the current instance. */
#include "ensemble/lanes/ensemble_start.h"
#include "base/memory.h"
#include "constraints/closing/close_reduced.h"
#include "constraints/evaluation/charts.h"
#include "constraints/evaluation/condition_modes.h"
#include "constraints/evaluation/intended_rank.h"
#include "constraints/evaluation/jacobian_and_mass.h"
#include "constraints/evaluation/load_multipliers.h"
#include "constraints/evaluation/row_residuals.h"
#include "constraints/evaluation/shown_outputs.h"
#include "constraints/tolerances.h"
#include "dynamics/motion.h"
#include "ensemble/lanes/ensemble_apart.h"
#include "ensemble/lanes/ensemble_conditions.h"
#include "ensemble/lanes/ensemble_engine.h"
#include "ensemble/lanes/ensemble_inside.h"
#include "ensemble/lanes/ensemble_measure.h"
#include "ensemble/lanes/ensemble_within.h"
#include "ensemble/lanes/lane_events.h"
#include "ensemble/lanes/lane_group.h"
#include "integrators/decide/coordinate_exchange.h"
#include "integrators/decide/run_start.h"
#include "integrators/formulations/reduced.h"
#include "integrators/run/friction_state.h"
#include "integrators/run/runner.h"
#include "model/data/model.h"
#include "model/read/read_mass.h"
#include <kempe/check.h>
#include <math.h>
#include <string.h>

static int most_freedoms(const kempe_system *s)
{
    return s->m > 0 ? KMP_LANE_FREEDOMS : KMP_LANE_TREE;
}

const char *kmp_engine_no_lanes(const kmp_engine *e)
{
    const kempe_system *s = e->s;
    const kmp_run_spec *spec = &e->spec;
    const struct {
        bool holds;
        const char *why;
    } reasons[] = {
        {e->execution.alone, "a request for separate runs"},
        {strcmp(spec->integrator, "dop853") != 0, "another integrator"},
        {strcmp(spec->formulation, "reduced") != 0 || strcmp(spec->form, "integrated") != 0, "another formulation"},
        {spec->keep_independent, "fixed independent coordinates"},
        {s->force != NULL, "user-defined forces"},
        {s->model->delay_count > 0, "delays"},
        {kmp_rounding_of(s) != NULL, "closures that are redundant up to rounding"},
        {s->m > KMP_LANE_ROWS || s->n - s->m > most_freedoms(s), "a large system"}};
    for (size_t k = 0; k < sizeof reasons / sizeof *reasons; k++)
        if (reasons[k].holds)
            return reasons[k].why;
    return kmp_conditions_no_lanes(s);
}

/* -- the current instance ----------------------------------------------------------------------------- */

kempe_status kmp_instance_take_values(kmp_engine *e, int i)
{
    kmp_ensemble_result *result = &e->results[i];
    kmp_text why = {0};
    kmp_context_clear(e->context);
    kempe_status status = kmp_variant_set(e->variant, e->values + (size_t)i * (size_t)e->columns, &why);
    if (status == KEMPE_OK && !kmp_system_rescale(e->s))
        status = kmp_fail_memory(e->context);
    if (status == KEMPE_OK)
        status = kmp_check_masses(kmp_variant_model(e->variant));
    if (status != KEMPE_E_INPUT)
        return status;
    result->status = status;
    result->reason = kmp_strdup(why.length ? why.s : kempe_context_message(e->context));
    kmp_text_free(&why);
    kmp_context_clear(e->context);
    return result->reason ? status : kmp_fail_memory(e->context);
}

void kmp_instance_current(kmp_engine *e, const kmp_instance *x)
{
    kmp_constants_take(e->s, &x->constants);
    kmp_eval_renew_parameters(e->eval);
    if (e->conditions)
        kmp_eval_set_modes(e->eval, x->mode);
    if (e->eval->nu)
        memcpy(e->eval->nu, x->nu, (size_t)e->m * sizeof *x->nu);
}

void kmp_instance_leave(kmp_engine *e, int i, const char *why)
{
    e->results[i].alone = true;
    e->results[i].why = why;
}

/* -- start ------------------------------------------------------------------------------------------- */

/* Sets the scale of rates from the accelerations at the start. false: these are not available. */
static bool set_rate_scale(kmp_engine *e, kmp_lane_group *pool, kmp_instance *x, const double *qd)
{
    double *qdd = e->state + 3 * e->n;
    if (kmp_reduction_factor(&pool->red))
        return false;
    kmp_reduction_tangent(&pool->red);
    if (!kmp_instance_complete(e, pool, qd, qdd, NULL))
        return false;
    x->rate_scale = kmp_start_rate(kmp_model_coordinates(e->s->model), e->s->scale, qd, qdd, 1 / e->spec.t_end);
    return isfinite(x->rate_scale);
}

/* Reason why an instance cannot enter the lanes at a closed start, the place of the evaluator's last closure; NULL: it
 * can. */
static const char *obstacle_at(const kmp_engine *e, const kmp_partition *part, const double *qd)
{
    if (part->p > most_freedoms(e->s))
        return "a large system";
    if (part->p == 0 && !e->s->rheonomic && !e->s->switches)
        return "no degree of freedom";
    double size = 1 / e->spec.t_end; /* check_rates of runner_start.c */
    for (int i = 0; i < e->n; i++)
        size = fmax(size, fabs(qd[i]) / e->s->scale[i]);
    return e->s->rheonomic && !(kmp_eval_rate_residual(e->eval, qd) <= KMP_CLOSED_START * size)
               ? "rates that the closures do not allow"
               : NULL;
}

bool kmp_instance_has_angles(const kmp_engine *e, const double *q, double least)
{
    for (int c = 0; c < kmp_charts_count(e->s) && !e->spec.own_angles; c++)
        if (kmp_chart_regular(e->s, c, q) < least)
            return false;
    return true;
}

/* Reason why a separate run begins an instance; NULL: lanes do. */
static const char *detour_at(const kmp_engine *e, const kmp_partition *part, const double *q)
{
    if (part->r > 0 && part->pivots[part->r - 1] < KMP_MARGIN_LOOK * part->pivots[0])
        return "a change point near the start";
    if (!kmp_instance_has_angles(e, q, KMP_AXES_CENTRED))
        return KMP_LANE_SINGULAR_ANGLES;
    return e->site && kmp_friction_is_smooth(e->site->friction) ? KMP_LANE_SMOOTH : NULL;
}

/* Chooses rows and coordinates at a start, at the site if there is one; *q and *qd are then the state there. */
static kempe_status choose(kmp_engine *e, kmp_instance *x, const kempe_assembly *a, const double **q, const double **qd,
                           kmp_partition *part)
{
    kmp_present_inputs_stand(&x->inputs, 0);
    if (e->site && !a->inner_q && kmp_instance_has_angles(e, a->q, KMP_AXES_CENTRED)) {
        KMP_TRY(kmp_instance_restart(e, x, a));
        *q = e->site->state;
        *qd = *q + e->n;
        kmp_eval_closure(e->eval, 0, *q);
        return kmp_made(e->context, kmp_partition_copy(part, &e->site->part));
    }
    kmp_eval_closure(e->eval, 0, *q);
    return kmp_partition_init(part, e->s, e->eval->jacobian, e->spec.u_count > 0 ? e->spec.u : NULL, e->spec.u_count);
}

/* Enters the lanes at a closed start, or leaves the instance to a separate run. */
static kempe_status enter(kmp_engine *e, int i, const kempe_assembly *a)
{
    kmp_instance *x = &e->instances[i];
    const double *q = a->q, *qd = a->qd;
    kmp_partition part;
    kmp_lane_group *pool = NULL;
    kempe_status status = choose(e, x, a, &q, &qd, &part);
    if (status == KEMPE_E_FAILED) { /* a separate run reports coordinates that are not possible */
        kmp_instance_leave(e, i, e->site ? "a start that a lane cannot make" : "given independent coordinates");
        kmp_context_clear(e->context);
        return KEMPE_OK;
    }
    if (status != KEMPE_OK)
        return status;
    const char *why = a->inner_q ? KMP_LANE_SINGULAR_ANGLES : obstacle_at(e, &part, qd);
    const char *detour = detour_at(e, &part, q);
    /* Sets the numbers of an instance at its start. */
    x->bound = (kmp_work_bound){.most = e->spec.max_steps};
    x->usual = part.r > 0 ? part.pivots[part.r - 1] : 1;
    x->limit = kmp_exchange_limit(part.user, false);
    x->error_old = KMP_RK_ERROR_FLOOR;
    x->seen_t = x->corrected.t = -1;
    if (!why && !kmp_instance_begin_conditions(e, x, q, qd))
        why = "a condition that ends the run at its start";
    if (!why && !detour)
        status = kmp_lane_group_find(e, &part, &pool);
    if (status == KEMPE_OK && !why && detour) {
        kmp_instance_begin_account(e, i);
        status = kmp_instance_start_apart(e, i, part.r, 0, q, qd, 0, detour);
    } else if (status == KEMPE_OK && pool && set_rate_scale(e, pool, x, qd)) {
        kmp_reduced_pack(&part, true, q, qd, x->y);
        kmp_instance_begin_account(e, i);
        kmp_lane_group_put(e, pool, i);
    } else {
        kmp_instance_leave(e, i, why ? why : "another choice of coordinates");
    }
    kmp_partition_free(&part);
    return status;
}

kempe_status kmp_instance_assemble(kmp_engine *e, int i, kempe_assembly **a)
{
    KMP_TRY(kmp_instance_take_values(e, i));
    kmp_eval_renew_parameters(e->eval);
    KMP_TRY(kempe_assembly_new(e->s, a));
    const double *q = kempe_assembly_q(*a), *qd = kempe_assembly_qd(*a);
    e->results[i].rates_changed = (*a)->rates_changed;
    kmp_friction_state_open(e->eval);
    kmp_load_forget(e->eval);
    kmp_eval_freeze(e->eval, 0, q, qd);
    kmp_eval_closure(e->eval, 0, q);
    kmp_eval_mass(e->eval);
    e->instances[i].kinetic = kmp_eval_kinetic(e->eval, qd);
    e->instances[i].potential = kmp_eval_potential(e->eval, 0, q);
    return KEMPE_OK;
}

kempe_status kmp_instance_start(kmp_engine *e, int i)
{
    kempe_assembly *a = NULL;
    kempe_status status = kmp_instance_assemble(e, i, &a);
    if (status == KEMPE_OK) {
        kmp_constants_keep(e->s, &e->instances[i].constants);
        status = enter(e, i, a);
    } else if (status == KEMPE_E_FAILED) { /* a run would say the same */
        kmp_instance_leave(e, i, "loops that do not close");
    }
    kempe_assembly_free(a);
    if (status == KEMPE_E_INPUT)
        kmp_engine_count(e);
    return status == KEMPE_E_INPUT || status == KEMPE_E_FAILED ? KEMPE_OK : status;
}

/* -- exchange ---------------------------------------------------------------------------------------- */

bool kmp_instance_state(kmp_engine *e, kmp_lane_group *pool, double t, const double *y, double *q, double *qd,
                        bool closed)
{
    int p = pool->part.p;
    for (int k = 0; k < p; k++)
        q[pool->part.u[k]] = y[k];
    for (int k = 0; k < pool->part.r; k++)
        q[pool->part.v[k]] = y[2 * p + k];
    if (closed && kmp_reduction_close(&pool->red, t, q, NULL, 0))
        return false;
    kmp_eval_closure(e->eval, t, q);
    if (kmp_reduction_factor(&pool->red))
        return false;
    kmp_reduction_tangent(&pool->red);
    kmp_reduction_rates(&pool->red, y + p, qd);
    return true;
}

bool kmp_instance_unpack(kmp_engine *e, kmp_lane_group *pool, int i, bool closed)
{
    const kmp_instance *x = &e->instances[i];
    kmp_instance_current(e, x);
    bool ok = kmp_instance_state(e, pool, x->t, x->y, e->state, e->state + e->n, closed);
    if (!ok)
        kmp_instance_leave(e, i, "closures that are singular");
    return ok;
}

/* Puts an instance into a pool at (q, qd). */
static void change_pool(kmp_engine *e, kmp_lane_group *pool, const kmp_partition *part, int i, const double *q,
                        const double *qd)
{
    kmp_instance *x = &e->instances[i];
    kmp_reduced_pack(part, true, q, qd, x->y);
    x->has_slope = x->rejected = false;
    x->signs.known = false;
    x->hopeless = 0;
    x->error_old = KMP_RK_ERROR_FLOOR;
    x->limit = kmp_exchange_limit(false, false);
    kmp_lane_group_put(e, pool, i);
}

kempe_status kmp_instance_go_on(kmp_engine *e, int i, kempe_status status, kmp_partition *part, const double *q,
                                const double *qd)
{
    kmp_lane_group *pool = NULL;
    if (status == KEMPE_OK)
        status = kmp_lane_group_find(e, part, &pool);
    if (status == KEMPE_OK && pool)
        change_pool(e, pool, part, i, q, qd);
    else
        kmp_instance_leave(e, i, "another choice of coordinates");
    kmp_partition_free(part);
    return status == KEMPE_E_FAILED ? KEMPE_OK : status;
}

kempe_status kmp_instance_exchange(kmp_engine *e, kmp_lane_group *from, int i)
{
    kmp_partition part;
    if (!kmp_instance_unpack(e, from, i, false))
        return KEMPE_OK;
    KMP_TRY(kmp_made(e->context, kmp_partition_copy(&part, &from->part)));
    kempe_status status = kmp_partition_exchange(&part, e->s, e->eval->jacobian, kmp_exchange_limit(false, false));
    e->results[i].exchanges++;
    return kmp_instance_go_on(e, i, status, &part, e->state, e->state + e->n);
}

/* Scaled |Bvu| of the new choice are at most 1, since the exchanged one is the largest. */
kempe_status kmp_instance_swap(kmp_engine *e, kmp_lane_group *from, int i, int k)
{
    const kmp_instance *x = &e->instances[i];
    kmp_partition *part = &e->swapped;
    double *q = e->state, *qd = q + e->n;
    part->p = 1; /* that of the pool, with u and v[k] exchanged */
    part->r = from->part.r;
    part->u[0] = from->part.v[k];
    memcpy(part->v, from->part.v, (size_t)part->r * sizeof *part->v);
    part->v[k] = from->part.u[0];
    kmp_partition_take_rows(part, &from->part);
    kmp_partition_sort(part);
    kmp_lane_group *pool = kmp_lane_group_of_choice(e, part);
    if (!pool) { /* J at the state is needed to write one */
        if (!kmp_instance_unpack(e, from, i, false))
            return KEMPE_OK;
        KMP_TRY(kmp_lane_group_find(e, part, &pool));
    }
    if (!pool || !kmp_lane_group_is_ordered(pool))
        return kmp_instance_exchange(e, from, i);
    q[from->part.u[0]] = x->y[0];
    for (int j = 0; j < from->part.r; j++)
        q[from->part.v[j]] = x->y[2 + j];
    qd[part->u[0]] = x->dy[2 + k];
    e->results[i].exchanges++;
    change_pool(e, pool, part, i, q, qd);
    return KEMPE_OK;
}

kempe_status kmp_instance_resume(kmp_engine *e, kmp_lane_group *from, int i)
{
    kmp_instance *x = &e->instances[i];
    kmp_partition part;
    double limit = x->limit;
    KMP_TRY(kmp_made(e->context, kmp_partition_copy(&part, &from->part)));
    kempe_status status = kmp_instance_go_on(e, i, KEMPE_OK, &part, e->state, e->state + e->n);
    x->limit = limit;
    return status;
}

kempe_status kmp_instance_change_rows(kmp_engine *e, kmp_lane_group *from, int i)
{
    kmp_partition part;
    if (!kmp_instance_unpack(e, from, i, false))
        return KEMPE_OK;
    kempe_status status = kmp_partition_of_rank(&part, e->s, e->eval->jacobian, from->part.r, NULL, 0);
    if (status == KEMPE_E_FAILED) {
        kmp_instance_leave(e, i, "another choice of closure rows");
        kmp_context_clear(e->context);
        return KEMPE_OK;
    }
    return status == KEMPE_OK ? kmp_instance_go_on(e, i, status, &part, e->state, e->state + e->n) : status;
}

/* The step continues: the numbers are the same but for rounding. */
kempe_status kmp_instance_reorder(kmp_engine *e, kmp_lane_group *from, int i)
{
    kmp_instance *x = &e->instances[i];
    kmp_lane_group *pool = NULL;
    kempe_status status = KEMPE_OK;
    if (kmp_instance_unpack(e, from, i, false))
        status = kmp_lane_group_find(e, &from->part, &pool);
    if (status != KEMPE_OK)
        return status;
    x->signs.known = false; /* turns with the order */
    if (pool && pool != from)
        kmp_lane_group_put(e, pool, i);
    else
        kmp_instance_leave(e, i, "pivots that change their order");
    return KEMPE_OK;
}

/* -- end --------------------------------------------------------------------------------------------- */

void kmp_instance_judge(kmp_engine *e, int i, double t, const double *q, const double *qd, double work)
{
    kmp_ensemble_result *result = &e->results[i];
    kmp_eval_mass(e->eval);
    result->t = t;
    result->h = kmp_eval_residual(e->eval);
    result->hdot = kmp_eval_rate_residual(e->eval, qd);
    /* Drift of the energy without the work done, relative to its size. */
    const kmp_instance *x = &e->instances[i];
    double kinetic = kmp_eval_kinetic(e->eval, qd);
    double potential = kmp_eval_potential(e->eval, t, q);
    double size = fmax(fmax(x->kinetic, kinetic), fabs(potential - x->potential));
    double drift = fabs(kinetic + potential - x->kinetic - x->potential - work);
    result->drift = size > 0 ? drift / size : drift;
    memcpy(e->q + (size_t)i * (size_t)e->n, q, (size_t)e->n * sizeof(double));
    memcpy(e->qd + (size_t)i * (size_t)e->n, qd, (size_t)e->n * sizeof(double));
}

kempe_status kmp_instance_finish(kmp_engine *e, kmp_lane_group *pool, int i)
{
    const kmp_instance *x = &e->instances[i];
    double *q = e->state, *qd = q + e->n;
    if (!kmp_instance_unpack(e, pool, i, true))
        return KEMPE_OK;
    kmp_instance_judge(e, i, x->t, q, qd, e->s->dissipative ? x->y[e->n + pool->part.p] : 0);
    kmp_instance_measured(e, pool, i, x->t, NULL);
    e->results[i].status = KEMPE_OK;
    kmp_engine_count(e);
    return KEMPE_OK;
}
