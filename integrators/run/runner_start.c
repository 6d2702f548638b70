/* SPDX-License-Identifier: BSD-3-Clause */
/* The start of a run: independent rows and coordinates, consistent rates and accelerations, a formulation and an
 * integrator. */
#include "integrators/run/runner_start.h"
#include "base/arena.h"
#include "base/context.h"
#include "base/memory.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/evaluation/intended_rank.h"
#include "constraints/evaluation/load_multipliers.h"
#include "constraints/partition/singularity_causes.h"
#include "constraints/partition/undetermined_loads.h"
#include "constraints/tolerances.h"
#include "dynamics/load_dependent.h"
#include "dynamics/motion.h"
#include "integrators/decide/restart.h"
#include "integrators/decide/run_start.h"
#include "integrators/formulations/projected.h"
#include "integrators/impact/impact_problem.h"
#include "integrators/run/delays.h"
#include "integrators/run/methods.h"
#include "integrators/run/runner.h"
#include "integrators/run/runner_center.h"
#include "integrators/run/runner_explain.h"
#include "integrators/run/runner_integrator.h"
#include "integrators/run/sampler.h"
#include "linalg/dense/dot.h"
#include "model/data/run_settings.h"
#include "model/data/state.h"
#include <kempe/check.h>
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

kempe_status kmp_runner_choose(kmp_runner *run, double t, const double *q, int rank, const int *wish, int wish_count)
{
    const kempe_system *s = run->s;
    kmp_eval_closure(run->eval, t, q);
    KMP_TRY(kmp_partition_of_rank(&run->part, s, run->eval->jacobian, rank, wish, wish_count));
    kmp_eval_drop(run->eval, run->part.m - run->part.r, run->part.redundant);
    return kmp_load_check(run->eval, &run->part);
}

/* Makes a saddle system of the chosen rows. */
static kempe_status make_saddle(kmp_runner *run, kmp_saddle *saddle)
{
    if (kmp_saddle_init(saddle, run->eval, &run->part))
        return KEMPE_OK;
    kmp_saddle_free(saddle);
    return kmp_fail_memory(run->s->context);
}

kempe_status kmp_shared_saddle_need(kmp_runner *run, kmp_shared_saddle *shared)
{
    if (!shared->made)
        KMP_TRY(make_saddle(run, &shared->saddle));
    shared->made = true;
    return KEMPE_OK;
}

void kmp_shared_saddle_free(kmp_shared_saddle *shared)
{
    if (shared->made)
        kmp_saddle_free(&shared->saddle);
    shared->made = shared->factored = false;
}

/* The rows are closed by least motion in the mass: one that moves none is the cause where there is one. */
static kempe_status fail_closing(kmp_runner *run, double t, const double *q)
{
    kmp_text why = {0};
    kempe_status status = kmp_foresee_massless(run->eval, &run->part, t, q, &why);
    if (status == KEMPE_OK && why.s)
        status = kmp_fail(run->s->context, KEMPE_E_FAILED, "%s", why.s);
    else if (status == KEMPE_OK)
        status = kmp_fail(run->s->context, KEMPE_E_FAILED, "the closures cannot be solved at t = %.9g", t);
    kmp_text_free(&why);
    return status;
}

/* Closes q and qd on the rows that are now independent. The rows before closed only themselves, and a DAE integrator
 * would take the remaining gap of the others for a jump. */
kempe_status kmp_runner_project_by(kmp_runner *run, double t, double *q, double *qd, kmp_shared_saddle *shared)
{
    KMP_TRY(kmp_shared_saddle_need(run, shared));
    const kmp_closer closer = kmp_saddle_closer(&shared->saddle, run->balance.row);
    shared->factored = false;
    return kmp_close_state(&closer, run->room.lambda, t, q, qd) ? KEMPE_OK : fail_closing(run, t, q);
}

kempe_status kmp_runner_project(kmp_runner *run, double t, double *q, double *qd)
{
    kmp_shared_saddle own = {.made = false};
    kempe_status status = kmp_runner_project_by(run, t, q, qd, &own);
    kmp_shared_saddle_free(&own);
    return status;
}

/* True for rounded numbers, whose dropped rows are open, if q was closed on other rows than those kept now. */
bool kmp_runner_is_off(kmp_runner *run, double t, const double *q)
{
    if (!kmp_rounding_of(run->s))
        return false;
    kmp_eval_closure(run->eval, t, q);
    return kmp_eval_residual(run->eval) > KMP_CLOSED_ENOUGH;
}

/* True if the closures have these rates; otherwise a row, and by how much they differ. */
static bool has_rates(kmp_runner *run, const double *qd, int *moved, double *off)
{
    const kempe_system *s = run->s;
    double *rate = run->room.lambda, size = 1 / kmp_run_until(&run->spec), worst = 0;
    int row = 0;
    for (int r = 0; r < s->m; r++) {
        rate[r] = run->eval->h_t ? run->eval->h_t[r] : 0;
        size = fmax(size, fabs(rate[r]) / s->row_scale[r]);
        row = fabs(rate[r]) > 0 ? r : row; /* a moving row is the cause */
    }
    for (int i = 0; i < s->n; i++)
        size = fmax(size, fabs(qd[i]) / s->scale[i]);
    kmp_eval_rates(run->eval, qd, rate);
    for (int r = 0; r < s->m; r++)
        worst = fmax(worst, fabs(rate[r]) / s->row_scale[r]);
    *moved = row;
    *off = worst;
    return worst <= KMP_CLOSED_START * size;
}

/* Takes the rates that the closures have after an impact in which they switch. */
static kempe_status switch_rates(kmp_runner *run, double t, double *q, double *qd)
{
    kmp_eval_mass(run->eval);
    const double before = kmp_eval_kinetic(run->eval, qd);
    KMP_TRY(kmp_runner_project(run, t, q, qd));
    kmp_eval_mass(run->eval);
    const double after = kmp_eval_kinetic(run->eval, qd);
    run->spec.work_start += after - before;
    run->balance.work = run->spec.work_start;
    run->before.least = fmin(run->before.least, run->balance.work);
    run->before.most = fmax(run->before.most, run->balance.work);
    if (after < before)
        kmp_run_log_add(run->log, "impact", t, before, after, KMP_CLOSURES_SWITCH, before - after, before);
    return KEMPE_OK;
}

/* Checks that the closures allow the rates they demand: a coordinate cannot be driven at its dead centre. A run that
 * continues may do so at a kink of a drive. */
static kempe_status check_rates(kmp_runner *run, double t, double *q, double *qd)
{
    const kempe_system *s = run->s;
    int row;
    double worst;
    if (!s->rheonomic || has_rates(run, qd, &row, &worst))
        return KEMPE_OK; /* without time the assembly has checked it */
    if (run->spec.continues) {
        KMP_TRY(switch_rates(run, t, q, qd));
        if (has_rates(run, qd, &row, &worst))
            return KEMPE_OK;
    }
    const char *name = kmp_runner_driven_by(s, row);
    return kmp_fail(s->context, KEMPE_E_FAILED,
                    "the rate prescribed by constraint equation '%s'%s%s%s is impossible at the start: %.3g of it "
                    "remains; it is at "
                    "a dead centre, or drives contradict each other",
                    s->row_names[row], name ? ", of coordinate '" : "", name ? name : "", name ? "'," : "", worst);
}

kempe_status kmp_runner_accelerate_by(kmp_runner *run, double t, const double *q, const double *qd,
                                      kmp_shared_saddle *shared)
{
    kmp_eval_mass(run->eval);
    kmp_eval_bias(run->eval, qd);
    KMP_TRY(kmp_shared_saddle_need(run, shared));
    if (!shared->factored && kmp_saddle_factor(&shared->saddle)) {
        kmp_shared_saddle_free(shared);
        return kmp_explain_massless(run->eval, &run->part, t, q);
    }
    shared->factored = true;
    kmp_saddle_accelerations(&shared->saddle, run->room.qdd, run->room.lambda);
    return kmp_is_unsettled(run->eval) ? kmp_runner_fail_unsettled(run, t, q, qd) : KEMPE_OK;
}

kempe_status kmp_runner_accelerate(kmp_runner *run, double t, const double *q, const double *qd)
{
    kmp_shared_saddle own = {.made = false};
    kempe_status status = kmp_runner_accelerate_by(run, t, q, qd, &own);
    kmp_shared_saddle_free(&own);
    return status;
}

/* Tells of a start at which forces that depend on multipliers have two solutions. */
static kempe_status note_other_solution(kmp_runner *run)
{
    const kempe_system *s = run->s;
    kmp_saddle saddle;
    int row = 0;
    double other;
    if (s->load_row_count == 0)
        return KEMPE_OK;
    KMP_TRY(make_saddle(run, &saddle));
    if (!kmp_saddle_factor(&saddle) && kmp_saddle_find_other(&saddle, &row, &other))
        kmp_run_log_add(
            run->log, "solutions", run->spec.t_start, run->room.lambda[row], other,
            "force '%s' has two solutions: with %.6g and with %.6g for the multiplier of constraint equation '%s'; "
            "the run begins with the first",
            kmp_load_dependent_force(s, row), run->room.lambda[row], other, s->row_names[row]);
    kmp_saddle_free(&saddle);
    return KEMPE_OK;
}

kmp_formulation_start kmp_runner_given(kmp_runner *run, double t, const double *q, const double *qd, double work)
{
    return (kmp_formulation_start){.system = run->s,
                                   .eval = run->eval,
                                   .part = &run->part,
                                   .margin = &run->margin,
                                   .t = t,
                                   .q = q,
                                   .qd = qd,
                                   .work = work,
                                   .rtol = run->spec.rtol,
                                   .atol = run->spec.atol,
                                   .rate_scale = run->rate_scale,
                                   .length = kmp_runner_length(run, t),
                                   .log = run->log};
}

/* The kind of the next formulation. */
static const kmp_formulation_kind *present_kind(const kmp_runner *run)
{
    const kmp_formulation_kind *across =
        run->method->near_singular ? run->method->near_singular : &kmp_formulation_near_singular;
    return run->change_point.near ? across : run->method;
}

static bool as_dae(const kmp_runner *run)
{
    return kmp_runner_integrator(run)->dae && !kmp_runner_is_followed(run);
}

kempe_status kmp_runner_take_dynamics(kmp_runner *run)
{
    const kmp_formulation_kind *kind = present_kind(run);
    const bool explicit = !kmp_runner_integrator(run)->implicit && !as_dae(run);
    const bool by_bodies = run->by_bodies && kind->by_bodies && explicit;
    const bool by_products = run->eval->by_products && kind->by_products && explicit;
    if (!by_bodies && !by_products)
        KMP_TRY(kmp_eval_add_composite(run->eval));
    kmp_eval_set_by_bodies(run->eval, by_bodies);
    run->before.by_bodies = run->before.by_bodies || run->eval->by_bodies;
    return KEMPE_OK;
}

static kempe_status make_formulation(kmp_runner *run, double t, const double *q, const double *qd, double work)
{
    const kmp_formulation_kind *kind = present_kind(run);
    const kmp_solver_kind *solver = kmp_runner_integrator(run);
    kmp_formulation_start given = kmp_runner_given(run, t, q, qd, work);
    given.qdd = run->room.qdd;
    given.lambda = run->room.lambda;
    given.brief = run->brief;
    given.early = run->early || run->spec.fixed_step > 0;
    given.fixed = run->spec.keep_independent;
    given.restarts = !solver->corrects;
    given.implicit = solver->implicit;
    given.lanes = kmp_runner_begins_with(run)->lanes;
    given.may_change = run->choice.open && !run->choice.kind;
    given.dae = as_dae(run);
    given.user = run->spec.user;
    given.passed = run->events.caused ? &run->events.passed : NULL;
    KMP_TRY(kmp_runner_take_dynamics(run));
    run->formulation = kind->create(kind, &given);
    if (!run->formulation)
        return KEMPE_E_FAILED;
    run->formulation->by_bodies = run->eval->by_bodies;
    run->formulation->by_products = run->eval->by_products;
    return KEMPE_OK;
}

static const kmp_formulation_kind *method_of(const kmp_runner *run)
{
    return run->spec.kind ? run->spec.kind : kmp_formulation_find(run->spec.formulation, run->spec.form);
}

/* Finds whether the run may take articulated bodies, which are then derived. */
static kempe_status look_for_bodies(kmp_runner *run)
{
    const bool requested = run->s->dynamics == KMP_DYNAMICS_ARTICULATED;
    const kmp_solver_kind *kind = kmp_solver_find(run->spec.integrator);
    /* One integrator, which solves for M and C. */
    const bool implicit = kind->dae || (kind->implicit && !kind->stand_in && !run->choice.open && !run->choice.kind);
    if (!method_of(run)->by_bodies || (!requested && implicit))
        return KEMPE_OK;
    KMP_TRY(kmp_motion_need_bodies(run->s));
    run->may_take_bodies = run->s->bodies->program;
    return KEMPE_OK;
}

/* The backward error of the accelerations and multipliers in run->moved, n + m, by M and C. */
static kempe_status measure_bodies(kmp_runner *run, const double *q, const double *qd, double *error)
{
    kmp_saddle saddle;
    KMP_TRY(kmp_eval_add_composite(run->eval));
    kmp_eval_set_by_bodies(run->eval, false);
    kmp_eval_closure(run->eval, run->spec.t_start, q);
    kmp_eval_mass(run->eval);
    kmp_eval_bias(run->eval, qd);
    KMP_TRY(make_saddle(run, &saddle));
    *error = kmp_saddle_backward_error(&saddle, run->balance.row, run->balance.row + run->s->n);
    kmp_saddle_free(&saddle);
    return KEMPE_OK;
}

/* Relative difference of the accelerations at the start between articulated bodies and M and C. Both may be right
 * within the condition of the system where it is large, as on a long chain: the backward error decides. */
static kempe_status compare_bodies(kmp_runner *run, const double *q, const double *qd, double *off, bool *good)
{
    const kempe_system *s = run->s;
    kmp_saddle saddle;
    double *qdd = run->balance.row, size = run->rate_scale * run->rate_scale, error = INFINITY;
    kmp_eval_set_by_bodies(run->eval, true);
    kmp_eval_closure(run->eval, run->spec.t_start, q);
    kmp_eval_mass(run->eval);
    kmp_eval_bias(run->eval, qd);
    KMP_TRY(make_saddle(run, &saddle));
    if (!kmp_saddle_factor(&saddle)) {
        kmp_saddle_accelerations(&saddle, qdd, qdd + s->n);
        *off = 0;
        for (int i = 0; i < s->n; i++)
            *off = isfinite(qdd[i]) ? fmax(*off, fabs(qdd[i] - run->room.qdd[i]) / (s->scale[i] * size)) : INFINITY;
    }
    kmp_saddle_free(&saddle);
    if (isfinite(*off) && !kmp_saddle_bodies_agree(*off, error) && !run->eval->weighs_only)
        KMP_TRY(measure_bodies(run, q, qd, &error));
    *good = kmp_saddle_bodies_agree(*off, error);
    return KEMPE_OK;
}

/* Articulated bodies divide by the inertia that each joint moves with the loops open. If only the loops determine the
 * accelerations, M and C are used instead. */
static kempe_status choose_dynamics(kmp_runner *run, const double *q, const double *qd)
{
    double off = INFINITY;
    if (!run->may_take_bodies)
        return KEMPE_OK;
    KMP_TRY(kmp_eval_add_articulated(run->eval));
    if (kmp_eval_goes_by_links(run->eval)) /* no loop makes a motion definite that is none with all loops open */
        run->by_bodies = kmp_all_finite(run->s->n, run->room.qdd);
    else
        KMP_TRY(compare_bodies(run, q, qd, &off, &run->by_bodies));
    if (!run->by_bodies && run->eval->weighs_only && run->s->dynamics == KMP_DYNAMICS_AUTO) {
        KMP_TRY(kmp_eval_add_composite(run->eval));
        kmp_eval_set_by_bodies(run->eval, false);
        kmp_eval_closure(run->eval, run->spec.t_start, q);
        return kmp_runner_accelerate(run, run->spec.t_start, q, qd);
    }
    if (run->by_bodies || run->s->dynamics == KMP_DYNAMICS_AUTO)
        return KEMPE_OK;
    return kmp_fail(
        run->s->context, KEMPE_E_FAILED,
        "algorithm articulated: %ssome motion has almost no inertia at the start, and the accelerations have "
        "a relative error of %.3g; use the algorithm composite",
        run->part.r > 0 ? "with open loops " : "", off);
}

void kmp_runner_keep_loads(const kmp_runner *run, kmp_kept_loads *kept)
{
    kept->by_parts = run->formulation->by_parts;
    if (run->eval->nu)
        memcpy(kept->nu, run->eval->nu, (size_t)run->s->m * sizeof *kept->nu);
}

void kmp_runner_give_loads(kmp_runner *run, const kmp_kept_loads *kept)
{
    run->formulation->by_parts = kept->by_parts;
    if (run->eval->nu)
        memcpy(run->eval->nu, kept->nu, (size_t)run->s->m * sizeof *kept->nu);
}

kempe_status kmp_runner_dense(kmp_runner *run, double t)
{
    kmp_kept_loads *kept = &run->room.before_dense;
    kmp_runner_keep_loads(run, kept);
    kempe_status status = run->kind->dense(run->solver, t, run->room.y, run->room.yp);
    kmp_runner_give_loads(run, kept);
    return status;
}

/* The state within the last step, for the search for events. */
static kempe_status state_within(void *user, double t, kmp_state_depth depth, bool again, double *q, double *qd,
                                 double *qdd, double *lambda)
{
    kmp_runner *run = user;
    double work;
    if (!again)
        KMP_TRY(kmp_runner_dense(run, t));
    double *rates = depth >= KMP_STATE_RATES ? qd : NULL, *accelerations = depth >= KMP_STATE_WHOLE ? qdd : NULL;
    int said = run->formulation->row(run->formulation, t, run->room.y, q, rates, accelerations, lambda, &work);
    return said == KMP_GO ? KEMPE_OK : KEMPE_E_FAILED;
}

kempe_status kmp_runner_make(kmp_runner *run, double t, const double *q, const double *qd, double work)
{
    KMP_TRY(make_formulation(run, t, q, qd, work));
    kmp_formulation *formulation = run->formulation;
    run->room.y = KMP_ARENA_NEW(&formulation->arena, double, formulation->size);
    run->room.yp = formulation->yp ? KMP_ARENA_NEW(&formulation->arena, double, formulation->size) : NULL;
    KMP_TRY(kmp_made(run->s->context, !formulation->arena.failed));
    KMP_TRY(kmp_runner_make_integrator(run));
    if (!run->s->changes)
        return KEMPE_OK;
    if (!run->events.tracker) {
        bool past = run->spec.slopes && run->delays; /* the past of derivatives has a jump at a kink of a signal */
        const kmp_event_setup plan = {.system = run->s,
                                      .eval = run->eval,
                                      .span = kmp_run_span(&run->spec),
                                      .rtol = run->spec.rtol,
                                      .kinks = run->kind->undo && (!run->spec.kind || past),
                                      .closely = run->spec.closely,
                                      .log = run->log,
                                      .state = state_within,
                                      .user = run};
        run->events.tracker = kmp_event_tracker_new(&plan, &run->arena);
    }
    KMP_TRY(kmp_made(run->s->context, run->events.tracker));
    run->events.tracker->search.ready = false;
    return KEMPE_OK;
}

kempe_status kmp_runner_start(kmp_runner *run, double t, const double *y, const double *yp, double h)
{
    double end = kmp_runner_limit(run, t);
    end = end <= t || kmp_same_time(end, t) ? run->spec.t_end : end; /* a sample is due: it is taken before the step */
    h = kmp_restart_proposed(h, t);
    /* The first step of an implicit method is of order 1; its error is of the order of the tolerance for this length.
     */
    double short_one = fmin(0.1 * sqrt(run->spec.rtol) / run->rate_scale, 1e-3 * kmp_run_until(&run->spec));
    double first = run->kind->corrects || (run->kind->undo && h > 0) ? fmin(h, end - t) : short_one;
    return run->kind->start(run->solver, t, y, yp, end, first);
}

/* Measures the distance of the start from a change point, unless change points are ignored. */
kempe_status kmp_runner_compute_margin(kmp_runner *run, double t, const double *q)
{
    const char *word = run->spec.change_points;
    bool made = kmp_rank_margin_init(&run->margin, run->s, &run->part);
    if (made && word && strcmp(word, kmp_change_points_word(KMP_CHANGE_POINTS_IGNORE)) == 0)
        kmp_rank_margin_ignore(&run->margin);
    KMP_TRY(kmp_made(run->s->context, made));
    kmp_eval_closure(run->eval, t, q);
    kmp_rank_margin_begin(&run->margin, run->eval, t, q);
    return KEMPE_OK;
}

/* True for a run that continues where it stood: its modes of friction and contacts are decided. */
static bool has_modes(const kmp_runner *run)
{
    return run->spec.due && !run->spec.elsewhere;
}

/* Makes the room of a run's state, and what states that take next values, friction and contacts need. */
static kempe_status runner_make_parts(kmp_runner *run)
{
    int n = run->s->n, m = run->s->m;
    bool made =
        KMP_ARENA_MAKE(&run->arena, KMP_ROOM(double, n, &run->turned.now, &run->turned.next, &run->turned.before),
                       KMP_ROOM(double, 3 * n + m, &run->balance.row, &run->room.state),
                       KMP_ROOM(double, m, &run->room.before_rows.nu, &run->room.before_dense.nu),
                       KMP_ROOM(double, run->s->jacobian.count + m, &run->room.rows));
    if (run->spec.slopes && run->s->switches) {
        run->events.passed.caused = run->events.caused = KMP_ARENA_NEW(&run->arena, bool, run->s->events.count);
        made = made && run->events.caused;
    }
    KMP_TRY(kmp_made(run->s->context, made));
    run->room.qdd = run->room.state + 2 * n;
    run->room.lambda = run->room.state + 3 * n;
    KMP_TRY(kmp_runner_make_sampler(run, run->spec.t_start));
    bool none;
    run->sticking.friction = kmp_friction_new(run, &none);
    run->events.passed.friction = run->sticking.friction;
    run->sticking.loaded = kmp_friction_is_loaded(run->s->model);
    KMP_TRY(kmp_made(run->s->context, run->sticking.friction || none));
    run->sticking.impacts = kmp_impact_new(run, &none);
    return kmp_made(run->s->context, run->sticking.impacts || none);
}

/* Conditions of a run that continues may depend on its past. */
static void take_modes(kmp_runner *run)
{
    const kmp_condition *condition = run->s->events.condition;
    const double *mode = run->spec.mode_start;
    for (int k = 0; mode && k < run->s->events.count; k++)
        if (condition[k].role != KMP_ROLE_NONE && has_modes(run))
            kmp_eval_set_kink(run->eval, k, mode[k]);
        else if (!condition[k].kink && condition[k].role == KMP_ROLE_NONE)
            kmp_eval_set_mode(run->eval, k, mode[k] > 0);
    run->spec.mode_start = NULL;
}

kempe_status kmp_runner_begin_at(kmp_runner *run, const kempe_assembly *start)
{
    double t = run->spec.t_start, *q = run->room.state, *qd = q + run->s->n;
    int input;
    if (run->spec.inputs_start)
        kmp_present_inputs_copy(&run->eval->inputs, run->spec.inputs_start);
    run->spec.inputs_start = NULL; /* the caller's, until here */
    if (!run->spec.due)
        (void)kmp_present_inputs_enter(&run->eval->inputs, t, &input);
    run->eval->inputs.held = true;
    kmp_runner_center_start(run, start);
    /* The past of a run that continues, or a new one. */
    if (run->spec.memory_start)
        kmp_runner_take_memory(run, run->spec.memory_start, run->spec.elsewhere);
    if (!run->spec.due)
        kmp_runner_take_samples(run, t);
    kmp_eval_freeze(run->eval, t, q, qd);
    /* States with hysteresis begin with the value that their input has at the start; conditions may depend on them. */
    if (!run->spec.memory_start && kmp_runner_settles(run)) {
        kmp_runner_take_samples(run, t);
        kmp_eval_freeze(run->eval, t, q, qd);
    }
    KMP_TRY(kmp_delays_begin(run, t));
    if (run->delays)
        kmp_eval_freeze(run->eval, t, q, qd);
    take_modes(run);
    if (!run->spec.memory_start)
        kmp_runner_note_events(run);
    run->spec.memory_start = NULL; /* the caller's, until here */
    kmp_partition_free(&run->part);
    KMP_TRY(kmp_runner_choose(run, t, q, -1, run->spec.u, run->spec.u_count));
    if (kmp_runner_is_off(run, t, q))
        KMP_TRY(kmp_runner_project(run, t, q, qd));
    KMP_TRY(check_rates(run, t, q, qd));
    if (!run->sticking.friction || has_modes(run))
        return kmp_runner_accelerate(run, t, q, qd);
    /* Modes are decided after impacts at the start. */
    double gain;
    if (run->sticking.impacts) {
        const long before = run->sticking.impacts->run.total;
        KMP_TRY(kmp_impact_check_start(run, t, q, qd));
        KMP_TRY((kempe_status)kmp_impact_decide(&run->sticking.impacts->run, t, q, qd, &gain));
        run->events.passed.impact = run->sticking.impacts->run.total > before ? &run->sticking.impacts->run : NULL;
    }
    return kmp_friction_settle(run, t, q, qd);
}

kempe_status kmp_runner_prepare(kmp_runner *run, const kempe_assembly *start)
{
    double t = run->spec.t_start;
    if (run->spec.threads > 1 && !(run->team = kmp_team_new(run->spec.threads)))
        return kmp_fail_memory(run->s->context);
    KMP_TRY(look_for_bodies(run));
    bool waits = run->may_take_bodies || (method_of(run)->by_products && run->s->late && run->s->late->by_products);
    /* A formulation of the caller's that evaluates the stages of a step in lanes evaluates the rest once a step. */
    const kmp_solver_kind *solver = kmp_solver_find(run->spec.integrator);
    kmp_eval_use steps = run->spec.kind && solver && solver->lanes ? KMP_EVAL_EVALUATES : KMP_EVAL_STEPS;
    run->eval = kmp_eval_new_for(run->s, run->spec.backend, run->team, waits ? KMP_EVAL_WEIGHS : steps);
    if (run->eval && run->eval->weighs_only)
        KMP_TRY(kmp_eval_add_articulated(run->eval));
    KMP_TRY(kmp_made(run->s->context, run->eval));
    kmp_eval_set_by_bodies(run->eval, kmp_eval_goes_by_links(run->eval));
    KMP_TRY(runner_make_parts(run));
    KMP_TRY(kmp_runner_begin_at(run, start));
    const double *q = run->room.state, *qd = q + run->s->n;
    KMP_TRY(note_other_solution(run));
    KMP_TRY(kmp_runner_compute_margin(run, t, q));
    if (run->part.p == 0 && !run->s->rheonomic && !run->sticking.friction)
        kmp_run_log_add(run->log, "rest", t, NAN, NAN,
                        "the mechanism cannot move: it has no degree of freedom, and no closure depends on time; "
                        "'kempe check' examines its closures");
    if (run->margin.near && (run->part.p > 0 || run->s->rheonomic)) /* else nothing moves onto any branch */
        kmp_log(run->s->context, KEMPE_LOG_WARNING,
                "the start is near a change point, where branches of the mechanism meet: the branch of the motion may "
                "depend on rounding");
    run->rate_scale = run->spec.rate_scale > 0 ? run->spec.rate_scale
                                               : kmp_start_rate(kmp_model_coordinates(run->s->model), run->s->scale, qd,
                                                                run->room.qdd, 1 / kmp_run_until(&run->spec));
    run->method = method_of(run);
    run->change_point.near = run->margin.near;
    KMP_TRY(choose_dynamics(run, q, qd));
    return kmp_runner_make(run, t, q, qd, run->spec.work_start);
}

/* A run that makes no steps. It is at states of other motions of its system, such as instances in lanes, where
 * impacts, modes and next values of states are decided as in a run. Each motion has a memory for what it knows of its
 * past. */

enum { MOST_PIECES = 8 };

kempe_status kmp_runner_site_new(kmp_evaluator *eval, const kmp_run_spec *spec, kmp_runner **site)
{
    KMP_MAKE(eval->system->context, kmp_runner, run);
    run->s = eval->system;
    run->spec = *spec;
    run->eval = eval;
    run->stops.at = spec->t_end;
    kempe_status status = runner_make_parts(run);
    return KMP_GIVE_OR_FREE(status, site, run, kmp_runner_site_free);
}

void kmp_runner_site_free(kmp_runner *site)
{
    if (!site)
        return;
    site->eval = NULL; /* the caller's */
    kmp_runner_free(site);
}

static int list_pieces(kmp_runner *run, kmp_memory_piece *piece)
{
    int count = kmp_runner_sampler_memory(run, piece);
    count += kmp_friction_memory(run->sticking.friction, piece + count);
    return count + kmp_impact_memory(run->sticking.impacts, piece + count);
}

size_t kmp_runner_memory_size(const kempe_system *system)
{
    return kmp_sampler_memory_size(system->model) + kmp_friction_memory_size(&system->events) +
           kmp_impact_memory_size(&system->events);
}

void kmp_runner_keep_memory(kmp_runner *run, void *memory)
{
    kmp_memory_piece piece[MOST_PIECES];
    char *to = memory;
    int count = list_pieces(run, piece);
    for (int k = 0; k < count; to += piece[k++].size)
        memcpy(to, piece[k].at, piece[k].size);
}

void kmp_runner_take_memory(kmp_runner *run, const void *memory, bool elsewhere)
{
    kmp_memory_piece piece[MOST_PIECES];
    const char *from = memory;
    int count = elsewhere ? kmp_runner_sampler_memory(run, piece) : list_pieces(run, piece);
    for (int k = 0; k < count; from += piece[k++].size)
        memcpy(piece[k].at, from, piece[k].size);
    kmp_friction_renew(run);
}
