/* SPDX-License-Identifier: BSD-3-Clause */
/* Changes between steps: events, change points, other rows or unknowns, a second chance for a stopped integrator. */
#include "integrators/run/runner_change.h"
#include "base/memory.h"
#include "constraints/closing/rounding.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/evaluation/intended_rank.h"
#include "constraints/evaluation/state_ends.h"
#include "constraints/tolerances.h"
#include "integrators/decide/dropped_rows.h"
#include "integrators/decide/restart.h"
#include "integrators/friction/friction_elements.h"
#include "integrators/impact/impact_problem.h"
#include "integrators/run/delays.h"
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include "integrators/run/runner.h"
#include "integrators/run/runner_center.h"
#include "integrators/run/runner_explain.h"
#include "integrators/run/runner_integrator.h"
#include "integrators/run/runner_start.h"
#include "integrators/run/runner_visits.h"
#include "integrators/run/sampler.h"
#include "integrators/steppers/singular_step.h"
#include "model/data/model.h"
#include "model/read/loads.h"
#include <float.h>
#include <math.h>

/* Inputs of the model during a run. Each step has one polynomial for each input: it ends at the next sample. Beyond it
 * the integrator restarts where a value jumps, and continues in its order elsewhere. */

/* An input of a closure must have no jump in value and rate, which no force can follow. */
static kempe_status check_closures(const kmp_runner *run, double t)
{
    const kmp_present_inputs *inputs = &run->eval->inputs;
    const kempe_model *model = run->s->model;
    for (int k = 0; k < inputs->count; k++) {
        const kmp_signal_piece *piece = &inputs->piece[k];
        bool jumps =
            kmp_same_time(piece->from, t) && piece->jump < 2 && !inputs->replaced[k]; /* callers' are checked before */
        const kmp_closure *closure = jumps ? kmp_model_moved_by(model, k) : NULL;
        if (closure)
            return kmp_fail(run->s->context, KEMPE_E_FAILED,
                            "%s:%d:%d: closure '%s' depends on input '%s', whose %s jumps at t = %.9g s: let its "
                            "samples be cubic and extend beyond the end of the run",
                            model->source.files[closure->place.file], closure->place.line, closure->place.column,
                            closure->name, model->inputs[k].name, piece->jump ? "rate" : "value", t);
    }
    return KEMPE_OK;
}

/* Takes the inputs from t on, after the row at t within the last step has been made. */
static kempe_status runner_take_inputs(kmp_runner *run, double t)
{
    int input;
    if (run->eval->inputs.count == 0 || kmp_present_inputs_enter(&run->eval->inputs, t, &input) >= 2)
        return KEMPE_OK;
    return check_closures(run, t);
}

/* Ends the run at t with the sentence of a condition: KEMPE_STOPPED. */
static kempe_status runner_end(kmp_runner *run, double t, int condition)
{
    kmp_text text = {0};
    run->events.ended = true;
    run->events.requested = !run->s->events.condition[condition].advice;
    if (run->reason)
        return KEMPE_STOPPED;
    kmp_put_end(&text, run->s, condition, t);
    run->reason = kmp_text_take(&text);
    return run->reason ? KEMPE_STOPPED : kmp_fail_memory(run->s->context);
}

/* Changes the conditions that the inputs from t on have changed, at the state in run->room.state; ends the run if one
 * of them requires it. */
static kempe_status runner_take_conditions(kmp_runner *run, double t)
{
    const double *q = run->room.state, *qd = q + run->s->n;
    bool changed;
    if (!run->events.tracker || (run->eval->inputs.count == 0 && !run->sampler))
        return KEMPE_OK;
    KMP_TRY(kmp_event_tracker_change(run->events.tracker, t, q, qd, false, &changed));
    run->events.tracker->end = kmp_event_tracker_first_end(run->events.tracker);
    return run->events.tracker->end >= 0 ? runner_end(run, t, run->events.tracker->end) : KEMPE_OK;
}

/* Goes on beyond a sample of an input where the last step has ended at it: restarts the integrator where the value
 * jumps. */
static kempe_status runner_pass_samples(kmp_runner *run, double t)
{
    kmp_present_inputs *inputs = &run->eval->inputs;
    int input, jump;
    if (kmp_present_inputs_are_due(inputs, t)) {
        jump = kmp_present_inputs_enter(inputs, t, &input);
        if (jump < 2)
            KMP_TRY(check_closures(run, t));
        run->stops.anew = run->stops.anew || jump == 0 || (jump == 1 && run->spec.slopes && run->delays);
        kmp_delays_follow(run, t);
    }
    if (kmp_runner_sample_is_due(run, t)) {
        run->stops.anew = true;
        kmp_delays_jump(run, 0);
    }
    double limit = kmp_runner_limit(run, t);
    if (run->stops.anew || run->solver->t_end == limit)
        return KEMPE_OK;
    if (run->kind->extend)
        return run->kind->extend(run->solver, limit);
    run->solver->t_end = limit;
    return KEMPE_OK;
}

void kmp_runner_stop_at(kmp_runner *run, double stop)
{
    run->stops.at = stop;
}

void kmp_runner_bound_until(kmp_runner *run, double t)
{
    run->bounds.ahead = (kmp_work_bound){.end = "t"};
    run->bounds.until = t;
}

kmp_present_inputs *kmp_runner_inputs(kmp_runner *run)
{
    return &run->eval->inputs;
}

const double *kmp_runner_modes(const kmp_runner *run)
{
    return run->eval->conditions.mode;
}

double kmp_runner_rate_scale(const kmp_runner *run)
{
    return run->rate_scale;
}

kempe_status kmp_runner_pass(kmp_runner *run, double t, bool *passed)
{
    *passed = run->events.here && t == run->events.t;
    return *passed ? kmp_runner_change(run, t) : KEMPE_OK;
}

/* Multistep methods under inputs that jump. Each restart is at order one, in many short steps whose errors are near the
 * tolerance and add up: with samples every 1 to 50 ms they were 10 to 500 times the tolerance, in two to five times the
 * evaluations of a one-step method, which keeps order and step size. Gear (ACM TOMS 6 (1980) 263) starts multistep
 * methods by Runge-Kutta steps; a history cannot be given to SUNDIALS, so a one-step method replaces it until restarts
 * have become rare: an explicit one for Adams, a stiffly accurate one for BDF. */

/* A restart is frequent after fewer steps of the multistep method: its start at order one takes 20 to 35 of them. The
 * multistep method returns after this number of steps of the one-step method, which simulate some 100 of its steps, and
 * twice as many after each return. */
enum { FREQUENT = 100, QUIET = 24, MOST_DOUBLED = 16 };

kmp_stand_in kmp_runner_stand_in(const kmp_runner *run)
{
    return run->stand_in;
}

/* At a restart for inputs: true if another integrator is to continue, for which the formulation is made again. */
static bool runner_relieve(kmp_runner *run, double t)
{
    long tried = kmp_runner_tried(run), steps = tried - run->restarted;
    const kmp_solver_kind *own = run->kind;
    run->restarted = tried;
    /* At the start of a run, a limit of steps before its end announces the first restart. */
    const bool frequent = steps > 0 ? steps < FREQUENT : kmp_runner_pause(run) < run->spec.t_end;
    if (!own->stand_in || !frequent)
        return false;
    run->stand_in.active = true;
    run->choice.kind = own->stand_in;
    kmp_run_log_add(
        run->log, "integrator", t, (double)steps, FREQUENT,
        "integrator changed to %s: inputs jump often, and each restart of %s at order one would add an error",
        own->stand_in->name, own->name);
    return true;
}

/* Continues at t with a new formulation for the present integrator, from the state that the old one completes, with
 * `first_step`. */
static kempe_status runner_change_formulation(kmp_runner *run, double t, bool near_singular, double first_step)
{
    double work;
    KMP_TRY(kmp_runner_inner_row(run, t, true, run->room.state, &work));
    return kmp_runner_restart(run, t, near_singular, work, first_step);
}

/* Between steps, at t: returns to the multistep method after enough steps without a restart. */
static kempe_status runner_return(kmp_runner *run, double t)
{
    long returns = run->stand_in.returns < MOST_DOUBLED ? run->stand_in.returns : MOST_DOUBLED;
    if (!run->stand_in.active || run->stops.anew || run->change_point.near ||
        kmp_runner_tried(run) - run->restarted < (long)QUIET << returns)
        return KEMPE_OK;
    run->stand_in.active = false;
    run->stand_in.returns++;
    run->restarted = kmp_runner_tried(run);
    run->choice.kind = NULL;
    kmp_run_log_add(run->log, "integrator", t, NAN, NAN,
                    "integrator changed back to %s: inputs have not jumped for %ld steps", run->spec.integrator,
                    (long)QUIET << returns);
    return runner_change_formulation(run, t, false, 0);
}

/* Number of looks for a change point near its predicted place. */
enum { PROBES = 10 };
/* Least number of steps between two rescues of an implicit integrator. */
enum { RESCUE_WAY = 100 };

/* Chooses coordinates again at q, as many as at the start, and rows where the present ones do not serve or closures
 * have switched; a fixed u is kept. Bvu belongs to any rows. */
static kempe_status choose_again(kmp_runner *run, double t, const double *q, bool switched)
{
    kmp_partition before = run->part;
    run->part = (kmp_partition){0};
    bool fixed = run->spec.keep_independent && before.p == run->s->n - run->margin.r;
    kempe_status status = kmp_runner_choose(run, t, q, run->margin.r, before.u, fixed ? before.p : 0);
    kmp_partition_free(&before);
    if (status != KEMPE_OK || run->margin.r == 0)
        return status;
    if (!switched) { /* others would have other multipliers */
        (void)kmp_rank_margin_at(&run->margin, run->eval);
        if (kmp_dropped_judge(run->margin.rows) == KMP_KEPT_WELL)
            kmp_partition_take_rows(&run->part, &run->margin.part);
    }
    KMP_TRY(kmp_made(run->s->context, kmp_rank_margin_choose(&run->margin, &run->part) &&
                                          kmp_rank_margin_exchange_rows(&run->margin, run->eval)));
    kmp_partition_take_rows(&run->part, &run->margin.part);
    kmp_eval_drop(run->eval, run->part.m - run->part.r, run->part.redundant);
    return KEMPE_OK;
}

/* Lets the formulation take what the next one needs, at t within its last step and with the conditions there. */
static kempe_status keep_unknowns(kmp_runner *run, double t)
{
    kmp_formulation *formulation = run->formulation;
    const bool kept = !formulation->keep || (kmp_runner_dense(run, t) == KEMPE_OK &&
                                             formulation->keep(formulation, t, run->room.y) == KMP_GO);
    return kept ? KEMPE_OK : KEMPE_E_FAILED;
}

/* Continues with the formulation for rows that are chosen again. `held`: these change because conditions hold others,
 * which may return. */
static kempe_status restart(kmp_runner *run, double t, bool near_singular, double work, double first_step, bool held)
{
    bool returned = false;
    double *q = run->room.state, *qd = q + run->s->n;
    if (!run->events.passed.now)
        KMP_TRY(keep_unknowns(run, t));
    kmp_runner_leave(run, held);
    run->change_point.since = run->change_point.near ? run->change_point.since : t;
    run->change_point.near = near_singular;
    run->balance.work = work;
    run->balance.t = t;
    KMP_TRY(choose_again(run, t, q, false));
    if ((run->method->dae && !near_singular) || kmp_runner_is_off(run, t, q)) {
        KMP_TRY(kmp_runner_project(run, t, q, qd));
        KMP_TRY(kmp_runner_accelerate(run, t, q, qd));
    }
    if (held)
        KMP_TRY(kmp_runner_return(run, t, &returned));
    if (returned)
        return kmp_runner_start(run, t, run->room.y, run->room.yp, first_step);
    KMP_TRY(kmp_runner_make(run, t, q, qd, work));
    return kmp_runner_start(run, t, run->formulation->y, run->formulation->yp, first_step);
}

kempe_status kmp_runner_restart(kmp_runner *run, double t, bool near_singular, double work, double first_step)
{
    return restart(run, t, near_singular, work, first_step, false);
}

/* Continues at t with another formulation, and makes a step. */
static kempe_status step_with_another(kmp_runner *run, double t, bool near_singular)
{
    KMP_TRY(runner_change_formulation(run, t, near_singular, 0));
    return run->kind->step(run->solver);
}

/* Writes the rates of the accelerations to `jerk`, by the accelerations in the middle of the last step; zero if these
 * are not available. */
static void find_jerk(kmp_runner *run, double t, double *jerk)
{
    int n = run->s->n;
    double *row = run->balance.row, *qdd = row + 2 * n, work, back = 0.5 * (t - kmp_runner_t_old(run));
    bool found = back > 0 && kmp_runner_dense(run, t - back) == KEMPE_OK &&
                 kmp_formulation_row(run->formulation, t - back, run->room.y, row, &work) == KMP_GO;
    for (int i = 0; i < n; i++)
        jerk[i] = found ? (run->room.qdd[i] - qdd[i]) / back : 0;
}

/* True if a change point lies ahead of the closed state at t, about tau later. Evaluates J along the predicted motion,
 * repeatedly at the point where the line from the last place comes nearest to zero. */
static bool lies_ahead(kmp_runner *run, double t, double tau)
{
    int n = run->s->n;
    const double *q = run->room.state, *qd = q + n, tried = run->margin.tried;
    double *predicted = run->balance.row, *jerk = predicted + 2 * n, before = 0, farthest = 0;
    const double there = KMP_MARGIN_THERE * run->margin.last / run->margin.usual;
    bool found = false;
    find_jerk(run, t, jerk);
    double size = run->margin.last, last = INFINITY;
    for (int k = 0; k < PROBES && tau > 0 && isfinite(tau) && !found && size < KMP_MARGIN_AHEAD * last; k++) {
        double when, next;
        for (int i = 0; i < n; i++)
            predicted[i] = q[i] + tau * (qd[i] + 0.5 * tau * (run->room.qdd[i] + tau / 3 * jerk[i]));
        kmp_eval_closure(run->eval, t + tau, predicted);
        found = kmp_rank_margin_at(&run->margin, run->eval) < there;
        when = kmp_rank_margin_when(&run->margin);
        kmp_rank_margin_stand(&run->margin);
        farthest = fmax(farthest, tau);
        last = size;
        size = run->margin.last;
        next = tau + when * (tau - before);
        before = tau;
        tau = next;
    }
    kmp_eval_closure(run->eval, t, q);
    (void)kmp_rank_margin_at(&run->margin, run->eval);
    kmp_rank_margin_stand(&run->margin);
    run->margin.tried = tried; /* probes do not leave the surroundings */
    run->margin.clear_t = found ? t : t + 0.5 * farthest;
    return found;
}

/* Returns to the formulation: after a single step across, or after steps when the surroundings of the change point are
 * left. A step whose end is nearest has not reached it; the next one does. */
static kempe_status leave_near_singular(kmp_runner *run, double t)
{
    bool walked = run->change_point.walks;
    double since = run->change_point.since, from = kmp_runner_t_old(run), at = 0, size = 0;
    if (walked && run->margin.tried > 0)
        return KEMPE_OK;
    if (!walked)
        kmp_singular_step_nearest(run->solver, &at, &size);
    run->change_point.walks = false;
    KMP_TRY(runner_change_formulation(run, t, false, 0));
    if (walked)
        kmp_run_log_add(run->log, "change point", t, NAN, NAN,
                        "the integrator stopped near a change point; the projected formulation continued from t = %.9g "
                        "s to this time with dop853",
                        since);
    else if ((at > from || from == run->spec.t_start) && at < t && size < KMP_NEAR_SINGULAR_IN)
        kmp_run_log_add(run->log, "change point", at, size, run->margin.last / run->margin.usual,
                        "change point crossed between t = %.9g and %.9g s in one step; the direction of motion is kept "
                        "(independence of the constraints %.2g)",
                        from, t, size);
    return KEMPE_OK;
}

/* If J is near to losing a row, steps across a change point take over, and the formulation continues beyond it. If only
 * the independent rows become singular, others are taken. */
static kempe_status watch_margin(kmp_runner *run, double t)
{
    if (kmp_rank_margin_unwatched(&run->margin) || !(t > kmp_runner_t_old(run)))
        return KEMPE_OK;
    if (run->margin.step_t != t)
        KMP_TRY(kmp_runner_place(run, t));
    (void)kmp_rank_margin_after_step(&run->margin, run->eval, t);
    double when;
    bool enters = kmp_rank_margin_leads_on(&run->margin, &when);
    kmp_rank_margin_stand(&run->margin);
    if (run->change_point.near)
        return run->margin.last > KMP_NEAR_SINGULAR_OUT * run->margin.usual ? leave_near_singular(run, t) : KEMPE_OK;
    if (kmp_dropped_judge(run->margin.rows) != KMP_KEPT_WELL) {
        /* Dropped rows have large coefficients in kept rows, and are exchanged. */
        double before = run->margin.rows;
        KMP_TRY(runner_change_formulation(run, t, false, run->solver->h));
        kmp_run_log_add(run->log, "rows", t, before, run->margin.rows,
                        "independent constraint equations chosen again: redundant ones depended on them by factors up "
                        "to %.2g, now %.2g",
                        before, run->margin.rows);
        return KEMPE_OK;
    }
    if (!enters)
        return KEMPE_OK;
    double work;
    KMP_TRY(kmp_runner_inner_row(run, t, true, run->room.state, &work));
    bool ahead = lies_ahead(run, t, when * (t - kmp_runner_t_old(run)));
    return ahead ? runner_change_formulation(run, t, true, 0) : KEMPE_OK;
}

/* By articulated bodies each acceleration is the sum of what the multipliers make of it and of the rest. If the rest is
 * so large that its rounding shows, because a joint moves almost no inertia, M and C are used. */
static kempe_status watch_bodies(kmp_runner *run, double t)
{
    const double *open = run->margin.r > 0 ? kmp_eval_open(run->eval) : NULL;
    double most = 0;
    for (int i = 0; open && i < kmp_model_coordinates(run->s->model); i++)
        most = isfinite(open[i]) ? fmax(most, fabs(open[i]) / run->s->scale[i]) : INFINITY;
    double size = run->rate_scale * run->rate_scale;
    if (DBL_EPSILON * most <= KMP_MARGIN_CANCELLED * run->spec.rtol * size || !(t > kmp_runner_t_old(run)))
        return KEMPE_OK;
    run->by_bodies = false;
    KMP_TRY(runner_change_formulation(run, t, false, 0));
    kmp_run_log_add(run->log, "dynamics", t, most, size,
                    "some joint moves almost no inertia when the loops are open: from this time on the run uses the "
                    "mass matrix, not the articulated-body algorithm");
    return KEMPE_OK;
}

/* Continues at t with new unknowns and a step h. */
static kempe_status begin_unknowns(kmp_runner *run, double t, double h)
{
    KMP_TRY(kmp_runner_begin_unknowns(run, t, &h));
    return kmp_runner_start(run, t, run->room.y, run->room.yp, h);
}

/* Puts the closed state at t into the unknowns, which may change for it, and continues with a step h. */
static kempe_status resume(kmp_runner *run, double t, const double *q, const double *qd, double h)
{
    kmp_formulation *formulation = run->formulation;
    const long exchanges = formulation->exchanges;
    kmp_runner_end_unknowns(run);
    if (formulation->resume(formulation, t, q, qd, run->room.y, run->room.yp) != KMP_GO)
        return KEMPE_E_FAILED;
    return formulation->exchanges > exchanges ? begin_unknowns(run, t, h)
                                              : kmp_runner_start(run, t, run->room.y, run->room.yp, h);
}

/* Lets the formulation change its unknowns at the end of the last step; the integrator then restarts, a one-step method
 * with its present step size. */
static kempe_status renew(kmp_runner *run, double t)
{
    double h = t - kmp_runner_t_old(run);
    if (!run->formulation->renew || !(h > 0))
        return KEMPE_OK;
    if (kmp_runner_leaves_unknowns(run, t)) {
        run->method = kmp_formulation_find("projected", NULL);
        KMP_TRY(runner_change_formulation(run, t, false, run->solver->h));
        kmp_run_log_add(run->log, "formulation", t, NAN, NAN,
                        "the independent coordinates approach a dead centre: the run continues with the projected "
                        "formulation, which needs none");
        return KEMPE_OK;
    }
    if (kmp_runner_takes_unknowns_again(run)) {
        KMP_TRY(runner_change_formulation(run, t, false, run->solver->h));
        kmp_run_log_add(
            run->log, "formulation", t, NAN, NAN,
            "the run continues with independent coordinates: the projected formulation loses digits at many "
            "states, where it is slow");
        return KEMPE_OK;
    }
    KMP_TRY(kmp_runner_dense(run, t));
    kmp_runner_end_unknowns(run);
    switch (run->formulation->renew(run->formulation, t, run->room.y, run->room.yp)) {
    case KMP_GO:
        return KEMPE_OK;
    case KMP_CHANGED:
        return begin_unknowns(run, t, run->solver->h > 0 ? run->solver->h : h);
    default:
        return KEMPE_E_FAILED;
    }
}

static kempe_status renew_margin(kmp_runner *run, double t, const double *q)
{
    kmp_rank_margin_free(&run->margin);
    return kmp_runner_compute_margin(run, t, q);
}

/* Notes the conditions of the event that is passed, before they change. */
static void note_event(kmp_runner *run, double t)
{
    kmp_event_tracker *c = run->events.tracker;
    const kmp_condition *condition = run->s->events.condition;
    run->events.passed =
        (kmp_passed_event){.now = true, .caused = run->events.caused, .friction = run->sticking.friction};
    kmp_event_tracker_put_beyond(c, t, c->change);
    for (int k = 0; k < run->s->events.count; k++)
        run->events.caused[k] =
            kmp_event_tracker_changed(c, k) &&
            kmp_condition_may_change((kmp_condition_kind)c->kind[k], condition[k].role == KMP_ROLE_SENSE, &c->mode[k]);
}

/* Makes rates consistent with the present closures: the nearest ones in the kinetic energy, as after impulses along the
 * rows' forces. This is a plastic impact with the least loss of energy. Conditions may depend on rates, so that further
 * ones change. Then contacts strike, and modes are decided. Gains of kinetic energy, J: *energy by closures that
 * switch, *gain by contacts. *same: the rows are those before. */
static kempe_status meet_closures(kmp_runner *run, double t, double *energy, double *gain, bool *same)
{
    double *q = run->room.state, *qd = q + run->s->n, before = 0;
    bool changed = true, any = false;
    if (!run->eval->by_products)
        KMP_TRY(kmp_eval_add_composite(run->eval));
    kmp_eval_set_by_bodies(run->eval, false);
    if (run->sticking.friction) { /* small rates of closed contacts that remain would make them strike or part */
        memcpy(run->sticking.friction->change, run->events.tracker->change,
               (size_t)run->s->events.count * sizeof(double));
        kmp_event_tracker_put_beyond(run->events.tracker, t, run->sticking.friction->change);
        kmp_friction_note_values(run->sticking.friction);
        KMP_TRY(kmp_friction_release_rows(run, t, q, qd));
    }
    for (int pass = 0; changed; pass++) { /* each changes once at most */
        KMP_TRY(kmp_event_tracker_change(run->events.tracker, t, q, qd, pass > 0, &changed));
        if (changed && run->sticking.friction && !any) {
            kmp_friction_drop_kept(run);
            KMP_TRY(renew_margin(run, t, q));
        }
        if (changed || (pass == 0 && !run->sticking.friction)) /* which has let go */
            KMP_TRY(choose_again(run, t, q, true));
        if (pass == 0) {
            kmp_eval_mass(run->eval);
            before = kmp_eval_kinetic(run->eval, qd);
        }
        any = any || changed;
        if (changed)
            KMP_TRY(kmp_runner_project(run, t, q, qd));
    }
    *gain = 0;
    *same = false;
    if (run->sticking.impacts) {
        const long struck = run->sticking.impacts->run.total;
        KMP_TRY((kempe_status)kmp_impact_decide(&run->sticking.impacts->run, t, q, qd, gain));
        run->events.passed.impact = run->sticking.impacts->run.total > struck ? &run->sticking.impacts->run : NULL;
    }
    run->events.passed.switched = any;
    if (run->sticking.friction) { /* rows that begin or cease to be held change the rank */
        const bool alone = !any && run->eval->inputs.count == 0 && !run->sampler;
        KMP_TRY((alone ? kmp_friction_settle_changed : kmp_friction_settle)(run, t, q, qd));
        run->events.tracker->count++;
        *same = kmp_friction_holds_as_before(run);
        kmp_friction_end_decision(run);
        if (!*same)
            KMP_TRY(renew_margin(run, t, q));
    } else {
        KMP_TRY(kmp_runner_accelerate(run, t, q, qd));
    }
    *energy = any ? kmp_eval_kinetic(run->eval, qd) - before - *gain : 0; /* else only friction has changed */
    return KEMPE_OK;
}

/* Meets the closures at t from the state before it in run->room.state. */
static kempe_status switch_here(kmp_runner *run, double t, double *energy, double *gain, bool *same)
{
    KMP_TRY(runner_take_inputs(run, t));
    kmp_runner_take_samples(run, t);
    return meet_closures(run, t, energy, gain, same);
}

/* The kinetic energy of rates that count as none. */
static double energy_of_rest(const kmp_runner *run)
{
    double *rates = run->balance.row;
    for (int i = 0; i < run->s->n; i++)
        rates[i] = KMP_FRICTION_STILL * run->s->scale[i] * run->rate_scale;
    return kmp_eval_kinetic(run->eval, rates);
}

/* Before inputs and states change at the state in run->room.state: a condition that has changed at t changes back if
 * they change its value, and not by the rounding of a restart. */
static void note_conditions(kmp_runner *run, double t)
{
    if (run->events.tracker && run->sampler)
        kmp_event_tracker_note(run->events.tracker, t, run->room.state, run->room.state + run->s->n);
}

static void forget_conditions(kmp_runner *run)
{
    if (run->events.tracker)
        run->events.tracker->noted = false;
}

/* Switches closures: the state before, then consistent rates. The energy lost in the impact counts as work; an impact
 * of rounding size is not an impact. `event`: one has been found at t, otherwise inputs and states may change. */
static kempe_status pass_switch(kmp_runner *run, double t, bool event)
{
    double *q = run->room.state, work, energy, gain;
    bool same, plain = !run->eval->by_bodies && !run->eval->by_products;
    KMP_TRY(kmp_runner_inner_row(run, t, true, run->room.state, &work));
    if (run->events.caused) { /* steps are interpolated with the conditions before the event */
        note_event(run, t);
        KMP_TRY(keep_unknowns(run, t));
    }
    if (!event)
        note_conditions(run, t);
    kempe_status met = switch_here(run, t, &energy, &gain, &same);
    forget_conditions(run);
    KMP_TRY(met);
    double after = kmp_eval_kinetic(run->eval, q + run->s->n), before = after - energy;
    if (-energy > fmax(run->spec.rtol * before, energy_of_rest(run)))
        kmp_run_log_add(run->log, "impact", t, before, after, KMP_CLOSURES_SWITCH, -energy, before);
    const double begin = run->solver->t_old, instant = KMP_FRICTION_INSTANT * kmp_friction_span(run);
    const double h =
        kmp_restart_length(run->solver->t - begin, t - begin, instant, kmp_impact_since(run->sticking.impacts));
    /* The formulation continues with other rates where its equations are explicit, and it needs no exact closing of
     * dropped rows and keeps no further unknowns. */
    const bool goes_on = run->formulation->resume && !run->formulation->keep && !run->spec.kind && !run->room.yp &&
                         !run->change_point.near && !kmp_rounding_of(run->s);
    if (!same || !plain || !goes_on) {
        kempe_status status = restart(run, t, false, work + energy + gain, h, true);
        run->events.passed.now = false;
        return status;
    }
    if (run->s->dissipative) /* the last unknown */
        run->room.y[run->formulation->size - 1] += energy + gain;
    return resume(run, t, q, q + run->s->n, h);
}

/* Part of the largest entry of J within which it does not jump at an event, which is located to rounding. */
#define JUMP 1e-9

/* True if J and h_t do not jump with the conditions that change at t of an event, as where a smooth step begins: rates
 * do not jump either. */
static bool keeps_rows(kmp_runner *run, double t)
{
    kmp_event_tracker *c = run->events.tracker;
    kmp_evaluator *eval = run->eval;
    const kmp_pattern *entries = &run->s->jacobian;
    const double *scale = run->s->scale;
    double *h_t = run->room.rows + entries->count, size = 0, off = 0;
    if (run->sticking.friction || kmp_event_tracker_look(c, t) != KEMPE_OK)
        return false;
    kmp_eval_closure(eval, t, c->q);
    memcpy(run->room.rows, eval->jacobian, (size_t)entries->count * sizeof *h_t);
    memcpy(h_t, eval->h_t ? eval->h_t : run->room.rows, eval->h_t ? (size_t)run->s->m * sizeof *h_t : 0);
    if (kmp_event_tracker_foresee(c, t) != KEMPE_OK)
        return false;
    kmp_eval_closure(eval, t, c->q);
    for (int k = 0; k < entries->count; k++) {
        size = fmax(size, fabs(run->room.rows[k]) * scale[entries->col[k]]);
        off = fmax(off, fabs(eval->jacobian[k] - run->room.rows[k]) * scale[entries->col[k]]);
    }
    for (int r = 0; eval->h_t && r < run->s->m; r++)
        off = fmax(off, fabs(eval->h_t[r] - h_t[r]) / run->rate_scale);
    kmp_eval_set_modes(eval, c->before);
    return off <= JUMP * size;
}

/* Changes conditions and restarts the integrator, a one-step method with its present step size. */
static kempe_status pass_event(kmp_runner *run, double t)
{
    double h = run->solver->t - run->solver->t_old;
    if (!run->events.here)
        return KEMPE_OK;
    if (run->events.tracker->end >= 0)
        return runner_end(run, t, run->events.tracker->end);
    const bool switches = run->s->switches && !keeps_rows(run, t);
    kmp_event_tracker *c = run->events.tracker;
    kempe_status status = switches ? pass_switch(run, t, true) : kmp_event_tracker_pass(c, t, true);
    if (status == KEMPE_OK && !switches) /* the state there, on closed loops, into the unknowns */
        status = resume(run, t, c->q, c->qd, h);
    run->events.here = status != KEMPE_OK;
    return status;
}

/* The step size of a one-step method; an earlier one if the last steps were cut short. */
static double step_it_had(const kmp_runner *run, double t)
{
    double last = t - kmp_runner_t_old(run);
    return fmax(run->solver->h > 0 ? run->solver->h : last, run->stops.pace);
}

double kmp_runner_step_size(const kmp_runner *run)
{
    double t = kmp_runner_t(run);
    bool begins = t == run->spec.t_start && run->spec.first_step > 0; /* not every integrator reports its next step */
    return !run->kind->corrects ? 0 : begins ? run->spec.first_step : step_it_had(run, t);
}

/* True if inputs and states may change closures. */
static bool gives_switches(const kmp_runner *run)
{
    return (run->eval->inputs.count > 0 || run->sampler) && run->events.tracker && run->s->switches;
}

/* Takes states of samples and of events at t, and the conditions that they change, which may be events of others, by
 * `pass` until none changes. A state that changes without end is left as it is after some passes: conditions that
 * change back and forth are reported elsewhere. *work grows by the work of these changes. */
static kempe_status take_states(kmp_runner *run, double t,
                                kempe_status (*pass)(kmp_runner *run, double t, double *work), double *work)
{
    bool more = true;
    for (int k = 0; more && k <= run->s->model->state_count; k++) {
        KMP_TRY(pass(run, t, work));
        more = kmp_runner_meets_events(run);
    }
    return KEMPE_OK;
}

/* Conditions that depend on inputs and states, after closures have met them. */
static kempe_status take_conditions_again(kmp_runner *run, double t)
{
    note_conditions(run, t);
    const kempe_status status = runner_take_conditions(run, t);
    forget_conditions(run);
    return status;
}

static kempe_status meet_here(kmp_runner *run, double t, double *work)
{
    double energy, gain;
    bool same;
    KMP_TRY(switch_here(run, t, &energy, &gain, &same));
    *work += energy + gain;
    return KEMPE_OK;
}

/* Passes of take_states: without closures that switch; with them; with them and a restart of the integrator. */
static kempe_status pass_samples(kmp_runner *run, double t, double *work)
{
    (void)work;
    kmp_runner_take_samples(run, t);
    return runner_take_conditions(run, t);
}

static kempe_status pass_closures(kmp_runner *run, double t, double *work)
{
    note_conditions(run, t);
    const kempe_status met = meet_here(run, t, work);
    forget_conditions(run);
    return met == KEMPE_OK ? take_conditions_again(run, t) : met;
}

static kempe_status pass_restart(kmp_runner *run, double t, double *work)
{
    (void)work;
    run->stops.anew = false;
    KMP_TRY(pass_switch(run, t, false));
    return take_conditions_again(run, t);
}

/* Takes inputs and states from t on, at the state in run->room.state. */
static kempe_status renew_here(kmp_runner *run, double t)
{
    note_conditions(run, t);
    KMP_TRY(runner_take_inputs(run, t));
    KMP_TRY(take_states(run, t, pass_samples, NULL));
    forget_conditions(run);
    return KEMPE_OK;
}

kempe_status kmp_runner_pass_here(kmp_runner *run, double t, bool event, double *work)
{
    *work = 0;
    if (event && run->s->switches)
        KMP_TRY(meet_here(run, t, work));
    else if (event)
        KMP_TRY(kmp_event_tracker_pass(run->events.tracker, t, false));
    if (!kmp_runner_meets_events(run) && event)
        return KEMPE_OK;
    return gives_switches(run) ? take_states(run, t, pass_closures, work) : renew_here(run, t);
}

kempe_status kmp_runner_begin_anew(kmp_runner *run, double t)
{
    double *q = run->room.state, *qd = q + run->s->n, work, h = step_it_had(run, t);
    bool relieved = runner_relieve(run, t);
    if (gives_switches(run))
        return take_states(run, t, pass_restart, NULL);
    KMP_TRY(kmp_runner_inner_row(run, t, true, run->room.state, &work));
    KMP_TRY(renew_here(run, t));
    if (relieved) {
        run->stops.anew = false;
        return kmp_runner_restart(run, t, false, work, 0);
    }
    if (run->events.tracker)
        run->events.tracker->search.ready = false; /* accelerations have changed */
    run->stops.anew = false;
    run->stops.pace = h;
    return resume(run, t, q, qd, h);
}

kempe_status kmp_runner_change(kmp_runner *run, double t)
{
    kmp_runner_follow(run, t);
    KMP_TRY(kmp_delays_record(run, t));
    bool event = run->events.here;
    KMP_TRY(pass_event(run, t));
    run->stops.anew = kmp_runner_meets_events(run) || run->stops.anew;
    if (event || run->stops.anew)
        kmp_delays_jump(run, 0);
    KMP_TRY(kmp_runner_center(run, t));
    KMP_TRY(watch_margin(run, t));
    KMP_TRY(watch_bodies(run, t));
    KMP_TRY(renew(run, t));
    KMP_TRY(runner_pass_samples(run, t));
    KMP_TRY(kmp_runner_try_integrator(run, t));
    KMP_TRY(runner_return(run, t));
    return run->stops.anew ? kmp_runner_begin_anew(run, t) : KEMPE_OK;
}

/* True if the projected formulation may continue: the user did not choose this one, and the integrator fits both. */
static bool may_project(const kmp_runner *run)
{
    const kmp_formulation_kind *projected = kmp_formulation_find("projected", NULL);
    const kmp_solver_kind *solver = kmp_runner_integrator(run);
    bool out_of_memory = kmp_memory_failures() != run->memory_failures;
    return run->spec.open && !run->stand_in.active && !out_of_memory && run->method != projected && solver->corrects &&
           !solver->implicit;
}

/* Replaces a stopped reduced formulation by the projected one, which needs no u, from the last accepted step. */
static kempe_status take_projected(kmp_runner *run, double t)
{
    kmp_text why = {0};
    if (kmp_runner_reason(run, "the step size became too small", t, &why)) {
        kmp_text_free(&why);
        return KEMPE_E_FAILED;
    }
    run->method = kmp_formulation_find("projected", NULL);
    run->spec.keep_independent = false;
    kmp_context_clear(run->s->context);
    kempe_status status = step_with_another(run, t, false);
    if (status == KEMPE_OK)
        kmp_run_log_add(run->log, "formulation", t, NAN, NAN,
                        "no choice of independent coordinates can continue (%s); the run continues with the projected "
                        "formulation, which needs none",
                        why.s ? why.s : "");
    kmp_text_free(&why);
    return status;
}

/* Makes the first step near a change point, a single step across or one of many. */
static kempe_status step_near_singular(kmp_runner *run, double t, bool walks)
{
    run->change_point.walks = walks;
    kmp_text_free(&run->formulation->reason);
    kmp_context_clear(run->s->context);
    return step_with_another(run, t, true);
}

/* Continues near a singular place after the formulation stopped: by a single step across, unless all failed before;
 * otherwise in ordinary steps, which restart where they ended. */
static kempe_status continue_near_singular(kmp_runner *run, double t)
{
    bool single = !(run->margin.tried > 0);
    kempe_status status = single ? step_near_singular(run, t, false) : KEMPE_E_FAILED;
    if (status != KEMPE_E_FAILED)
        return status;
    run->margin.tried = run->margin.last;
    return step_near_singular(run, t, true);
}

/* True if a step across may be tried: J is near to losing a row, and change points are not ignored. */
static bool is_near_singular(kmp_runner *run, double t)
{
    if (run->change_point.near || run->margin.ignored || run->margin.r == 0 ||
        kmp_memory_failures() != run->memory_failures || kmp_runner_place(run, t) != KEMPE_OK)
        return false;
    return kmp_rank_margin_at(&run->margin, run->eval) < KMP_NEAR_SINGULAR_IN;
}

/* Restarts a stopped implicit integrator once from its last place, projected and with rows chosen again: errors of past
 * steps may be the only cause. */
kempe_status kmp_runner_rescue(kmp_runner *run, double t)
{
    if (run->change_point.near && !run->change_point.walks) {
        /* The motion turns before the predicted change point: the formulation continues from there, and change points
         * are ignored until it has left the surroundings. */
        kempe_status status = runner_change_formulation(run, t, false, 0);
        run->margin.tried = run->margin.last; /* at t again: the step across evaluated it elsewhere */
        if (status == KEMPE_OK)
            status = run->kind->step(run->solver);
        if (status != KEMPE_E_FAILED)
            return status;
    }
    if (run->change_point.near && run->change_point.walks)
        return continue_near_singular(run, t);
    if (may_project(run))
        return take_projected(run, t);
    if (kmp_runner_lock(run, t) >= 0)
        return KEMPE_E_FAILED;
    if (is_near_singular(run, t))
        return continue_near_singular(run, t);
    if (!run->room.yp || run->formulation->reason.length > 0 ||
        (run->rescued_at > 0 && kmp_runner_tried(run) - run->rescued_at < RESCUE_WAY))
        return KEMPE_E_FAILED;
    run->rescued_at = kmp_runner_tried(run);
    kmp_context_clear(run->s->context); /* message of the stopped integrator */
    KMP_TRY(step_with_another(run, t, false));
    kmp_run_log_add(run->log, "restart", t, NAN, NAN, "the integrator stopped and was restarted from the same state");
    return KEMPE_OK;
}
