/* SPDX-License-Identifier: BSD-3-Clause */
/* Operations on one instance at a time: its start, an exchange of u, its end. The evaluator and the scales of
 * the system belong to the current instance. */
#include "ensemble/lanes/ensemble_start.h"
#include "base/memory.h"
#include "constraints/closing/assembly.h"
#include "constraints/closing/close.h"
#include "constraints/closing/start_gaps.h"
#include "constraints/evaluation/charts.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/evaluation/intended_rank.h"
#include "constraints/evaluation/load_multipliers.h"
#include "constraints/tolerances.h"
#include "ensemble/lanes/ensemble_conditions.h"
#include "ensemble/lanes/ensemble_engine.h"
#include "ensemble/lanes/ensemble_inside.h"
#include "ensemble/lanes/ensemble_measure.h"
#include "ensemble/lanes/lane_state.h"
#include "ensemble/lanes/lane_steps.h"
#include "integrators/decide/coordinate_exchange.h"
#include "integrators/decide/run_start.h"
#include "integrators/formulations/reduced.h"
#include "integrators/run/events.h"
#include "integrators/run/friction_state.h"
#include "integrators/run/runner.h"
#include "integrators/run/runner_change.h"
#include "integrators/run/runner_start.h"
#include "integrators/run/sampler.h"
#include "model/data/parameter.h"
#include "model/data/start.h"
#include "model/data/state.h"
#include "model/read/read_mass.h"
#include "output/verdict.h"
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
        {spec->fixed_step > 0, "steps of constant length"},
        {s->force != NULL, "user-defined forces"},
        {kmp_model_delay_count(s->model) > 0, "delays"},
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
    return e->site && kmp_friction_is_smooth(e->site->sticking.friction) ? KMP_LANE_SMOOTH : NULL;
}

/* Chooses rows and coordinates at a start, at the site if there is one; *q and *qd are then the state there. */
static kempe_status choose(kmp_engine *e, kmp_instance *x, const kempe_assembly *a, const double **q, const double **qd,
                           kmp_partition *part)
{
    kmp_present_inputs_stand(&x->inputs, 0);
    if (e->site && !a->inner_q && kmp_instance_has_angles(e, a->q, KMP_AXES_CENTRED)) {
        KMP_TRY(kmp_instance_restart(e, x, a));
        *q = e->site->room.state;
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
        kmp_instance_leave(e, i, e->site ? "a start that needs a run of its own" : "given independent coordinates");
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

/* Takes the values of an instance, closes its loops, and measures its energies: KEMPE_E_INPUT, or the status of the
 * assembly. An instance that has been assembled before has its start in `known`; NULL: it is assembled again. */
static kempe_status assemble_instance(kmp_engine *e, int i, kempe_assembly *known, kempe_assembly **a)
{
    const size_t n = (size_t)e->n, size = n * sizeof(double);
    double *start = e->starts && n > 0 ? e->starts + (size_t)i * 2 * n : NULL;
    KMP_TRY(kmp_instance_take_values(e, i));
    kmp_eval_renew_parameters(e->eval);
    const double *q = NULL, *qd = NULL;
    if (known && start && !isnan(start[0])) {
        *known = (kempe_assembly){.system = e->s, .q = start, .qd = start + n, .closed = true};
        q = known->q;
        qd = known->qd;
    } else {
        KMP_TRY(kmp_assembly_at_start(e->s, a));
        q = (*a)->q;
        qd = (*a)->qd;
        e->results[i].rates_changed = (*a)->rates_changed;
        const int moved = kmp_has_start_gaps(e->s) ? kmp_count_start_gaps(e->eval, q, NULL) : 0;
        KMP_TRY(kmp_made(e->s->context, moved >= 0));
        e->results[i].gaps_changed = moved > 0;
        e->results[i].unstable = (*a)->unstable;
        e->results[i].leaves = (*a)->balance && (*a)->balance->growing > 0;
        if (start && !(*a)->inner_q) {
            memcpy(start, q, size);
            memcpy(start + n, qd, size);
        }
    }
    kmp_friction_state_open(e->eval);
    kmp_load_forget(e->eval);
    kmp_eval_freeze(e->eval, 0, q, qd);
    kmp_eval_closure(e->eval, 0, q);
    kmp_eval_mass(e->eval);
    e->instances[i].kinetic = kmp_eval_kinetic(e->eval, qd);
    e->instances[i].potential = kmp_eval_potential(e->eval, 0, q);
    return KEMPE_OK;
}

/* The longest step of an instance whose functions of time are its own. */
static kempe_status find_longest(kmp_engine *e, int i)
{
    kmp_time_scales scales;
    kmp_arena aside = {0};
    const double given = e->execution.max_step;
    if (!e->execution.own_pulses)
        return KEMPE_OK;
    kempe_status status = kmp_ensemble_time_scales(e->s, &e->spec, &aside, &scales);
    if (scales.open && !(given > 0))
        e->pulses = scales;
    e->pulses.end = NULL;
    e->instances[i].longest = fmin(given > 0 ? given : INFINITY, scales.open && given > 0 ? INFINITY : scales.shortest);
    kmp_arena_free(&aside);
    return status;
}

/* The specification of a run of an instance by itself, which finds its own pulses where instances differ in them. */
static kmp_run_spec spec_alone(const kmp_engine *e)
{
    kmp_run_spec spec = e->spec;
    spec.max_step = e->execution.own_pulses ? e->execution.max_step : spec.max_step;
    return spec;
}

kempe_status kmp_instance_start(kmp_engine *e, int i)
{
    kempe_assembly *a = NULL, known = {0};
    kempe_status status = assemble_instance(e, i, &known, &a);
    if (status == KEMPE_OK)
        status = find_longest(e, i);
    if (status == KEMPE_OK) {
        kmp_constants_keep(e->s, &e->instances[i].constants);
        status = enter(e, i, known.q ? &known : a);
    } else if (status == KEMPE_E_FAILED) { /* a run would say the same */
        kmp_instance_leave(e, i,
                           kmp_model_start(e->s->model)->at ? "a start that is not found" : "loops that do not close");
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
    part->p = 1; /* the choice of the pool, with u and v[k] exchanged */
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
        kmp_instance_leave(e, i, "another choice of constraint equations");
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
        kmp_instance_leave(e, i, "another order of elimination");
    return KEMPE_OK;
}

/* -- end --------------------------------------------------------------------------------------------- */

/* Measures the end of an instance; the evaluator's closure belongs to q. `past`: of its conditions; NULL: there are
 * none. */
static void judge_instance(kmp_engine *e, int i, double t, const double *q, const double *qd, double work,
                           const kmp_condition_past *past)
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
    double exchanged = fmax(fmax(x->kinetic, kinetic), fabs(potential - x->potential));
    double drift = fabs(kinetic + potential - x->kinetic - x->potential - work);
    result->drift = kmp_verdict_drift(drift, exchanged, fmax(fabs(potential), fabs(x->potential)));
    for (int k = 0; k < e->s->events.count; k++)
        result->deflects = result->deflects ||
                           (e->s->events.condition[k].validity == KMP_VALIDITY_DEFLECTION && past && past[k].reported);
    memcpy(e->q + (size_t)i * (size_t)e->n, q, (size_t)e->n * sizeof(double));
    memcpy(e->qd + (size_t)i * (size_t)e->n, qd, (size_t)e->n * sizeof(double));
}

kempe_status kmp_instance_finish(kmp_engine *e, kmp_lane_group *pool, int i)
{
    const kmp_instance *x = &e->instances[i];
    double *q = e->state, *qd = q + e->n;
    if (!kmp_instance_unpack(e, pool, i, true))
        return KEMPE_OK;
    judge_instance(e, i, x->t, q, qd, e->s->dissipative ? x->y[e->n + pool->part.p] : 0,
                   e->conditions ? x->past : NULL);
    kmp_instance_measured(e, pool, i, x->t, NULL);
    if (e->site) {
        kmp_runner_take_memory(e->site, x->memory, false);
        e->results[i].shares = kmp_friction_feels_sharing(e->site->sticking.friction);
    }
    e->results[i].status = KEMPE_OK;
    kmp_engine_count(e);
    return KEMPE_OK;
}

/* -- separate runs ------------------------------------------------------------------------------------------ */

/* Separate runs of an instance: from its start to its end if lanes cannot run it; or from where a lane left it to where
 * lanes can take it back. Only the instance determines where a part begins and ends. */

/* Least steps of a part: its programs cost as much as some of them. Steps between two looks at the margin. */
enum { PART_STEPS = 8, PART_LOOKS = 4 };

/* -- to the end -------------------------------------------------------------------------------------- */

static void add_work(kmp_ensemble_result *result, const kmp_run_report *report)
{
    result->steps += report->steps;
    result->rejected += report->rejected;
    result->refused += report->refused;
    result->rhs += report->rhs;
    result->exchanges += report->exchanges;
}

/* Makes a step and takes it into the account of the instance. */
static kempe_status make_step(kmp_engine *e, int i, kmp_runner *run)
{
    kmp_text why = {0};
    KMP_TRY(kmp_runner_step(run));
    if (run->events.tracker && kmp_event_tracker_is_undecided(run->events.tracker, &why)) {
        run->reason = kmp_text_take(&why);
        return KEMPE_E_FAILED;
    }
    return kmp_run_measure(e, i, run) ? KEMPE_OK : KEMPE_E_FAILED; /* the row gave the reason */
}

/* Writes the result of an instance whose run has come to its end. */
static kempe_status finish(kmp_engine *e, int i, kmp_runner *run, kempe_status status)
{
    kmp_ensemble_result *result = &e->results[i];
    kmp_run_report report;
    double *row = KMP_NEW(double, 3 * e->n + e->m), work;
    kmp_runner_report(run, &report);
    result->status = status = report.requested ? KEMPE_OK : status;
    result->reason = report.reason;
    result->t = report.t;
    result->shares = kmp_friction_feels_sharing(run->sticking.friction);
    add_work(result, &report);
    if (run->eval)
        kmp_eval_set_modes(e->eval, kmp_runner_modes(run));
    if (row && run->solver && kmp_runner_row(run, report.t, row, &work) == KEMPE_OK) {
        if (kmp_runner_inputs(run)->past)
            kmp_engine_hold_inputs(e, kmp_runner_inputs(run));
        kmp_eval_closure(e->eval, report.t, row);
        judge_instance(e, i, report.t, row, row + e->n, work, run->events.tracker ? run->events.tracker->past : NULL);
        if (status == KEMPE_OK)
            kmp_instance_measured(e, NULL, i, report.t, row);
        kmp_engine_hold_inputs(e, NULL);
    }
    kmp_free(row);
    return !row ? kmp_fail_memory(e->context) : status == KEMPE_E_MEMORY ? status : KEMPE_OK;
}

/* Reports the reason of a failed start. */
static kempe_status fail_alone(kmp_engine *e, int i, kempe_status status)
{
    if (status == KEMPE_E_MEMORY)
        return status;
    e->results[i].status = KEMPE_E_FAILED;
    e->results[i].reason = kmp_strdup(kempe_context_message(e->context));
    kmp_context_clear(e->context);
    return e->results[i].reason ? KEMPE_OK : kmp_fail_memory(e->context);
}

kempe_status kmp_instance_alone(kmp_engine *e, int i)
{
    kempe_assembly *a = NULL;
    kmp_runner *run = NULL;
    kmp_ensemble_result *result = &e->results[i];
    result->steps = result->rejected = result->refused = result->rhs = result->exchanges = 0;
    result->parts = 0;
    kempe_status status = assemble_instance(e, i, NULL, &a);
    if (status == KEMPE_E_INPUT)
        return KEMPE_OK;
    const kmp_run_spec spec = spec_alone(e);
    if (status == KEMPE_OK)
        status = kmp_runner_new(e->s, &spec, a, &run);
    kmp_instance_begin_account(e, i);
    while (run && status == KEMPE_OK && kmp_runner_t(run) < e->spec.t_end)
        status = make_step(e, i, run);
    status = run ? finish(e, i, run, status) : fail_alone(e, i, status);
    kmp_runner_free(run);
    kempe_assembly_free(a);
    if (status == KEMPE_OK)
        kmp_context_clear(e->context);
    return status;
}

/* -- a part ------------------------------------------------------------------------------------------ */

/* The position of a run in a part. */
typedef struct part_state {
    double *row, work;   /* row: 3 n + m */
    kmp_partition found; /* at the last look, if the instance may return */
    double margin;       /* the last pivot of J over its usual size at the last look; -1: none yet */
} part_state;

/* True if lanes can take the instance back at the end of the last step: the usual formulation runs, the user's own
 * coordinates are good, and the closures recede from a change point. Sets the row and the partition there. */
static kempe_status look(kmp_engine *e, int i, kmp_runner *run, int rank, part_state *part, bool *returns)
{
    kmp_instance *x = &e->instances[i];
    double t = kmp_runner_t(run), before = part->margin;
    *returns = false;
    if (run->change_point.near || run->change_point.walks || run->events.here ||
        kmp_friction_is_smooth(run->sticking.friction) || kmp_runner_sample_is_due(run, t))
        return KEMPE_OK;
    rank = e->s->switches ? run->margin.r : rank;
    KMP_TRY(kmp_runner_row(run, t, part->row, &part->work));
    if (!kmp_instance_has_angles(e, part->row, KMP_AXES_RESUMED))
        return KEMPE_OK;
    if (e->conditions)
        kmp_eval_set_modes(e->eval, kmp_runner_modes(run));
    kmp_eval_closure(e->eval, t, part->row);
    kmp_partition_free(&part->found);
    KMP_TRY(kmp_partition_of_rank(&part->found, e->s, e->eval->jacobian, rank, NULL, 0));
    double last = rank > 0 ? part->found.pivots[rank - 1] : 1;
    x->usual = fmax(x->usual, last);
    part->margin = last / x->usual;
    *returns = before >= 0 && part->margin >= before && part->margin > KMP_NEAR_SINGULAR_LEFT;
    return KEMPE_OK;
}

/* Steps until lanes can take the instance back, or to the end. */
static kempe_status advance(kmp_engine *e, int i, kmp_runner *run, int rank, part_state *part, bool *returns)
{
    kempe_status status = KEMPE_OK;
    *returns = false;
    for (int steps = 1; status == KEMPE_OK && !*returns && kmp_runner_t(run) < e->spec.t_end; steps++) {
        status = make_step(e, i, run);
        if (status == KEMPE_OK && steps >= PART_STEPS && steps % PART_LOOKS == 0 && kmp_runner_t(run) < e->spec.t_end)
            status = look(e, i, run, rank, part, returns);
    }
    return status;
}

/* Puts the instance into a pool where the part has ended. */
static kempe_status come_back(kmp_engine *e, int i, kmp_runner *run, part_state *part)
{
    kmp_instance *x = &e->instances[i];
    kmp_run_report report;
    kmp_runner_count(run, &report);
    add_work(&e->results[i], &report);
    e->results[i].parts++;
    x->t = kmp_runner_t(run);
    x->h = kmp_runner_step_size(run);
    x->has_step = x->h > 0;
    x->tries = 0;
    x->seen_t = x->corrected.t = -1;
    x->pace = 0;
    if (e->conditions) {
        memcpy(x->mode, kmp_runner_modes(run), (size_t)e->s->events.count * sizeof *x->mode);
        memcpy(x->past, run->events.tracker->past, (size_t)e->s->events.count * sizeof *x->past);
    }
    if (e->eval->nu)
        memcpy(x->nu, part->row + 3 * e->n, (size_t)e->m * sizeof *x->nu);
    if (e->site) {
        kmp_runner_keep_memory(run, x->memory);
        x->next_sample = kmp_runner_next_sample(run);
        x->stood = true;
    }
    kmp_present_inputs_copy(&x->inputs, kmp_runner_inputs(run));
    if (e->s->dissipative)
        x->y[e->n + part->found.p] = part->work;
    return kmp_instance_go_on(e, i, KEMPE_OK, &part->found, part->row, part->row + e->n);
}

kempe_status kmp_instance_take_back(kmp_engine *e, int i, kmp_runner *run, int rank, double *margin, bool *taken)
{
    part_state part = {.margin = *margin, .row = KMP_NEW(double, 3 * e->n + e->m)};
    KMP_TRY(kmp_made(e->context, part.row));
    kempe_status status = look(e, i, run, rank, &part, taken);
    *margin = part.margin;
    if (status == KEMPE_OK && *taken)
        status = come_back(e, i, run, &part); /* frees the partition */
    else
        kmp_partition_free(&part.found);
    kmp_free(part.row);
    return status;
}

/* The run of a part, from (q, qd) in part->row; `margin` 0: the run finds the usual size of the margin. */
static kempe_status begin(kmp_engine *e, int i, double margin, kmp_run_spec *spec, const part_state *part,
                          kmp_runner **run)
{
    kmp_instance *x = &e->instances[i];
    kempe_assembly *a = kmp_assembly_new(e->s);
    KMP_TRY(kmp_made(e->context, a));
    memcpy(a->q, part->row, (size_t)e->n * sizeof *a->q);
    memcpy(a->qd, part->row + e->n, (size_t)e->n * sizeof *a->qd);
    a->closed = true;
    *spec = spec_alone(e);
    spec->t_start = x->t;
    spec->work_start = part->work;
    spec->rate_scale = x->rate_scale;
    spec->first_step = x->has_step ? x->h : 0;
    spec->inputs_start = &x->inputs;
    spec->u_count = margin > 0 ? 0 : e->spec.u_count;
    spec->mode_start = e->conditions ? x->mode : NULL;
    spec->memory_start = x->stood ? x->memory : NULL;
    kempe_status status = kmp_runner_new(e->s, spec, a, run);
    kempe_assembly_free(a);
    if (status == KEMPE_OK && margin > 0) /* as in the steps before */
        (*run)->margin.usual = fmax((*run)->margin.usual, (*run)->margin.last / margin);
    else if (status == KEMPE_OK && (*run)->margin.last > 0)
        x->usual *= (*run)->margin.usual / (*run)->margin.last;
    if (status == KEMPE_OK)
        x->rate_scale = kmp_runner_rate_scale(*run);
    if (status == KEMPE_OK && e->conditions)
        memcpy((*run)->events.tracker->past, x->past, (size_t)e->s->events.count * sizeof *x->past);
    return status;
}

/* The run of a part and what comes after it. */
static kempe_status run_part(kmp_engine *e, int i, int rank, double margin, part_state *part, const char *why)
{
    kmp_run_spec spec;
    kmp_runner *run = NULL;
    bool returns = false;
    e->results[i].why = why;
    kempe_status status = begin(e, i, margin, &spec, part, &run);
    if (status == KEMPE_OK)
        status = advance(e, i, run, rank, part, &returns);
    if (status == KEMPE_OK && returns) {
        status = come_back(e, i, run, part);
    } else if (status == KEMPE_OK || (status == KEMPE_STOPPED && run && kmp_runner_ended(run))) {
        e->results[i].parts++;
        status = finish(e, i, run, status);
        kmp_engine_count(e);
    } else if (status == KEMPE_E_FAILED || status == KEMPE_STOPPED) { /* a run from the start says why */
        kmp_instance_leave(e, i, why);
        status = KEMPE_OK;
    }
    kmp_runner_free(run);
    if (status == KEMPE_OK)
        kmp_context_clear(e->context);
    return status;
}

kempe_status kmp_instance_start_apart(kmp_engine *e, int i, int rank, double margin, const double *q, const double *qd,
                                      double work, const char *why)
{
    if (kmp_lane_steps_leave(e, i, rank, why))
        return KEMPE_OK;
    part_state part = {.margin = -1, .work = work, .row = KMP_NEW(double, 3 * e->n + e->m)};
    KMP_TRY(kmp_made(e->context, part.row));
    memcpy(part.row, q, (size_t)e->n * sizeof *q);
    memcpy(part.row + e->n, qd, (size_t)e->n * sizeof *qd);
    kempe_status status = run_part(e, i, rank, margin, &part, why);
    kmp_partition_free(&part.found);
    kmp_free(part.row);
    return status;
}

kempe_status kmp_instance_apart(kmp_engine *e, kmp_lane_group *from, int i, double margin, const char *why)
{
    if (kmp_lane_steps_leave(e, i, from->part.r, why) || !kmp_instance_unpack(e, from, i, true))
        return KEMPE_OK;
    KMP_TRY(kmp_instance_take_values(e, i));
    kmp_eval_renew_parameters(e->eval);
    return kmp_instance_start_apart(e, i, from->part.r, margin, e->state, e->state + e->n,
                                    e->s->dissipative ? e->instances[i].y[e->n + from->part.p] : 0, why);
}
