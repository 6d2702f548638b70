/* SPDX-License-Identifier: BSD-3-Clause */
/* One run, step by step: assembles, prepares, advances, delivers rows. */
#include "integrators/run/run.h"
#include "base/arena.h"
#include "base/context.h"
#include "base/memory.h"
#include "base/text.h"
#include "constraints/closing/assembly.h"
#include "constraints/diagnosis/shared_loads.h"
#include "constraints/evaluation/evaluator.h"
#include "integrators/decide/dropped_rows.h"
#include "integrators/decide/step_control.h"
#include "integrators/run/delays.h"
#include "integrators/run/events.h"
#include "integrators/run/friction_run.h"
#include "integrators/run/island_runs.h"
#include "integrators/run/methods.h"
#include "integrators/run/near_runs.h"
#include "integrators/run/recording.h"
#include "integrators/run/runner.h"
#include "integrators/run/runner_center.h"
#include "integrators/run/runner_change.h"
#include "integrators/run/runner_explain.h"
#include "integrators/run/runner_integrator.h"
#include "integrators/run/runner_start.h"
#include "integrators/run/runner_visits.h"
#include "integrators/run/sampler.h"
#include "model/data/body.h"
#include "model/data/state.h"
#include "platform/platform.h"
#include <kempe/kempe.h>
#include <limits.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

/* The default bound judges progress over the last window, not a total: a run may be long while it advances, and a phase
 * of short steps has no effect unless it fills a window. */

/* Steps of a window: about half a second for a small mechanism. Short phases, as oscillations of microseconds, take a
 * tenth of it even at the finest tolerances (bench/results/light_carriage.txt). */
enum { WINDOW = 100000 };
/* Largest number of steps still needed at the pace of the last window: some minutes for the smallest mechanism. The
 * longest runs of the examples and benchmarks take 1e6. */
static const double MOST_TO_COME = 1e8;

long kmp_work_bound_spare(const kmp_work_bound *bound, long tried)
{
    if (bound->most != 0)
        return bound->most < 0 ? LONG_MAX : bound->most - tried - 1;
    return bound->has_looked ? bound->seen + WINDOW - tried - 1 : 0;
}

bool kmp_work_bound_passed(kmp_work_bound *bound, long tried, double t, double t_end, kmp_text *why)
{
    if (bound->most != 0) {
        const bool reached = bound->most > 0 && tried >= bound->most && t < t_end;
        if (reached && why)
            kmp_text_printf(why, "the limit of %ld steps (max_steps) is reached at t = %.9g s of %.9g s", bound->most,
                            t, t_end);
        return reached;
    }
    if (bound->has_looked && tried - bound->seen < WINDOW)
        return false;
    double made = t - bound->seen_t, taken = (double)(tried - bound->seen), left = t_end - t;
    bool slow = bound->has_looked && left * taken > MOST_TO_COME * made;
    bound->has_looked = true;
    bound->seen = tried;
    bound->seen_t = t;
    if (!slow || !why)
        return slow;
    kmp_text_printf(why,
                    "too much work: at t = %.9g s the last %.0f steps advanced %.3g s, and %s = %.9g s needs %.1g "
                    "more: check start, masses and forces, or raise max_steps",
                    t, taken, made, bound->end ? bound->end : "t_end", t_end, made > 0 ? left * taken / made : 1e300);
    return true;
}

/* A row within the last step that its formulation cannot complete: inside a step its u, or the rows it keeps, may be
 * singular although they are good at both ends. The step is then repeated from its start to the time of the row by the
 * projected formulation, which needs no u, with rows chosen again as often as necessary. */

/* Largest number of its steps. */
enum { MOST_STEPS = 1000 };

typedef struct bridge {
    kmp_runner *run;
    double t, end, work;
    double *q, *qd; /* at t */
    kmp_partition part;
    kmp_rank_margin margin;
    kmp_formulation *formulation;
    const kmp_solver_kind *kind;
    kmp_solver *solver;
    double *y;
    int steps;
} bridge;

/* Makes rows, formulation and integrator for the present state. */
static bool set_up(bridge *b)
{
    kmp_runner *run = b->run;
    kmp_eval_closure(run->eval, b->t, b->q);
    if (kmp_partition_of_rank(&b->part, run->s, run->eval->jacobian, run->margin.r, NULL, 0) != KEMPE_OK ||
        !kmp_rank_margin_init(&b->margin, run->s, &b->part))
        return false;
    kmp_rank_margin_ignore(&b->margin);
    kmp_formulation_start given = kmp_runner_given(run, b->t, b->q, b->qd, b->work);
    given.part = &b->part;
    given.margin = &b->margin;
    b->formulation = kmp_formulation_projected.create(&kmp_formulation_projected, &given);
    if (!b->formulation)
        return false;
    b->kind = kmp_solver_find("dop853");
    b->y = KMP_ARENA_NEW(&b->formulation->arena, double, b->formulation->size);
    b->solver = b->kind->create(b->kind, &(kmp_solver_setup){.context = run->s->context,
                                                             .ode = &b->formulation->ode,
                                                             .dae = &b->formulation->dae,
                                                             .tolerance = {run->spec.rtol, b->formulation->atol}});
    return b->solver && b->y && b->kind->start(b->solver, b->t, b->formulation->y, NULL, b->end, 0) == KEMPE_OK;
}

/* Makes steps until the end, or until other rows are needed. false: they failed. */
static bool march(bridge *b)
{
    bool good = true, stays = true;
    while (good && stays && b->t < b->end) {
        good = b->steps++ < MOST_STEPS && b->kind->step(b->solver) == KEMPE_OK;
        b->t = b->solver->t;
        if (!good || b->part.r == b->part.m)
            continue;
        (void)kmp_rank_margin_after_step(&b->margin, b->run->eval, b->t);
        kmp_rank_margin_stand(&b->margin);
        stays = kmp_dropped_judge(b->margin.rows) == KMP_KEPT_WELL;
    }
    return good;
}

/* Repeats the step from `start` to t, in `row`; false: it failed. */
static bool repeat(kmp_runner *run, double start, double t, double *row, double *work)
{
    kmp_formulation *own = run->formulation;
    bridge b = {.run = run, .t = start, .end = t, .q = row, .qd = row + run->s->n};
    bool found = kmp_runner_dense(run, start) == KEMPE_OK &&
                 own->row(own, start, run->room.y, b.q, b.qd, NULL, NULL, &b.work) == KMP_GO;
    found = found && kmp_eval_add_composite(run->eval) == KEMPE_OK;
    kmp_eval_set_by_bodies(run->eval, false);
    while (found && b.t < t) {
        found = set_up(&b) && march(&b) && b.kind->dense(b.solver, b.t, b.y, NULL) == KEMPE_OK &&
                kmp_formulation_row(b.formulation, b.t, b.y, row, &b.work) == KMP_GO;
        if (b.solver)
            b.kind->release(b.solver);
        if (b.formulation)
            b.formulation->release(b.formulation);
        kmp_rank_margin_free(&b.margin);
        kmp_partition_free(&b.part);
        b.solver = NULL;
        b.formulation = NULL;
        b.y = NULL;
    }
    *work = b.work;
    return found;
}

bool kmp_runner_bridge(kmp_runner *run, double t, double *row, double *work)
{
    kmp_formulation *own = run->formulation;
    size_t size = 3 * (size_t)run->s->n + (size_t)run->s->m;
    double *state = KMP_NEW(double, size), start = kmp_runner_t_old(run), done;
    kmp_text why = own->reason;
    own->reason = (kmp_text){0};
    bool by_bodies = run->eval->by_bodies;
    bool known = kmp_formulation_find(run->method->formulation, run->method->form) ==
                 run->method; /* others have other unknowns */
    bool found = state && start < t && known && repeat(run, start, t, state, &done);
    kmp_eval_set_by_bodies(run->eval, by_bodies);
    if (found) {
        memcpy(row, state, size * sizeof *row);
        *work = done;
    }
    kmp_free(state);
    kmp_text_free(&own->reason);
    if (!found) {
        own->reason = why;
        return false;
    }
    kmp_context_clear(run->s->context);
    kmp_run_log_add(run->log, "row", t, NAN, NAN,
                    "%s: the step from t = %.9g was repeated up to this time with the projected formulation",
                    why.length ? why.s : "the state could not be completed", start);
    kmp_text_free(&why);
    return true;
}

long kmp_runner_tried(const kmp_runner *run)
{
    kmp_run_report all = run->before;
    kmp_runner_add_report(run, &all);
    return all.steps + all.rejected + all.refused;
}

/* Ends a run whose motion explodes; a given bound on steps is the user's. */
static kempe_status check_growth(kmp_runner *run, double t)
{
    const double tried = (double)kmp_runner_tried(run), *y;
    double *row = run->balance.row;
    if (run->bounds.now.most != 0 || tried < run->growth.next)
        return KEMPE_OK;
    y = kmp_runner_unknowns(run, t);
    double size = y ? kmp_growth_size(run->formulation->size, 1, y, run->solver->tolerance.atol, run->spec.atol) : 0;
    if (!kmp_growth_is_endless(&run->growth, tried, t, size) || kmp_runner_motion(run, t, row) != KEMPE_OK)
        return KEMPE_OK;
    const int motions = kmp_model_coordinates(run->s->model);
    const int k = kmp_growth_explodes(motions, NULL, motions, 1, row + run->s->n, run->s->scale, run->rate_scale);
    if (k < 0)
        return KEMPE_OK;
    kmp_text why = {0};
    kmp_text_printf(&why,
                    "the motion grows without end: at t = %.6g s '%s' has a rate of %.3g %s, and the state is ten "
                    "times larger than %.3g s before, repeatedly",
                    t, kmp_model_motion(run->s->model, k)->name, row[run->s->n + k],
                    kmp_model_motion(run->s->model, k)->rotation ? "rad/s" : "m/s",
                    run->growth.t[0] - run->growth.t[1]);
    size_t said = why.length;
    kmp_runner_explain_position(run, &why);
    if (why.length == said)
        kmp_text_put(&why, ": check the signs of forces, dampings and gains, or give a number of steps (max_steps)");
    run->reason = kmp_text_take(&why);
    return run->reason ? KEMPE_E_FAILED : kmp_fail_memory(run->s->context);
}

static kempe_status interrupt(kmp_runner *run)
{
    run->reason = kmp_strdup("interrupted");
    return KEMPE_STOPPED;
}

/* Reports progress and checks for interrupts, growth and the bound of work. */
static kempe_status attend(kmp_runner *run)
{
    const kmp_run_spec *spec = &run->spec;
    const double t = kmp_runner_t(run), from = spec->t_start, parts = fmax(spec->parts, 1); /* one after the other */
    kmp_progress(run->s->context, KMP_PROGRESS_RUN, from + (t - from + spec->part * (spec->t_end - from)) / parts,
                 kmp_run_until(spec), "s");
    if (kmp_interrupted(run->s->context))
        return interrupt(run);
    KMP_TRY(check_growth(run, t));
    kmp_text why = {0};
    if (!kmp_work_bound_passed(&run->bounds.now, kmp_runner_tried(run), t, kmp_run_until(spec), &why) &&
        !(t < run->bounds.until &&
          kmp_work_bound_passed(&run->bounds.ahead, kmp_runner_tried(run), t, run->bounds.until, &why)))
        return KEMPE_OK;
    kmp_runner_explain_position(run, &why);
    kmp_runner_explain_inertia(run, &why);
    run->reason = kmp_text_take(&why);
    return run->reason ? KEMPE_E_FAILED : kmp_fail_memory(run->s->context);
}

/* Finds the short intervals of the functions of time. A given longest step is another bound, and the remedy where there
 * are too many of them. */
static kempe_status find_time_scales(kmp_runner *run)
{
    const kmp_run_spec *spec = &run->spec;
    run->scales.shortest = run->scales_at_rest.shortest = INFINITY;
    if (!isfinite(spec->t_end))
        return KEMPE_OK;
    const kempe_system *s = run->s;
    KMP_TRY(kmp_time_scales_find(s->model, s->parameters, spec->t_start, spec->t_end, KMP_TIMED_SHORT, &run->arena,
                                 &run->scales));
    kmp_time_scales_doubt(s->context, &run->scales, spec->max_step);
    for (int k = 0; k < s->events.count; k++)
        run->events.watch_loads =
            run->events.watch_loads || (s->events.condition[k].late && s->events.condition[k].role == KMP_ROLE_NONE &&
                                        !s->events.condition[k].validity);
    if (kmp_system_watches_loads(s))
        KMP_TRY(kmp_time_scales_find(s->model, s->parameters, spec->t_start, spec->t_end, KMP_TIMED_ALL, &run->arena,
                                     &run->scales_at_rest));
    if (spec->max_step > 0 || isinf(run->scales_at_rest.shortest))
        kmp_time_scales_doubt(s->context, &run->scales_at_rest, spec->max_step);
    return KEMPE_OK;
}

/* Processor time in seconds so far, of all threads. */
static double cpu_of(const kmp_runner *run)
{
    return kmp_cpu_now() + kmp_team_cpu(run ? run->team : NULL);
}

/* Joints with clearance that start as without it, where the start follows from that. */
static void log_loose(kmp_runner *run, const kempe_assembly *start)
{
    kmp_text names = {0};
    if ((start->rested || start->centred) && kmp_assembly_put_loose(&names, start, KMP_LOOSE_REST) > 0)
        kmp_run_log_add(
            run->log, "start", run->spec.t_start, NAN, NAN, "%s: start position computed without clearance%s", names.s,
            start->centred ? "; the journal is centred, because its start value was outside the bearing" : "");
    kmp_text_free(&names);
}

kempe_status kmp_runner_new(const kempe_system *system, const kmp_run_spec *spec, const kempe_assembly *start,
                            kmp_runner **runner)
{
    double begin_s = kmp_cpu_now();
    kempe_assembly *own = NULL;
    kempe_status status = KEMPE_OK;
    unsigned long memory_failures = kmp_memory_failures();
    KMP_MAKE(system->context, kmp_runner, run);
    run->memory_failures = memory_failures;
    run->s = system;
    run->spec = *spec;
    run->stops.at = spec->t_end;
    run->own.context = system->context;
    run->log = spec->log ? spec->log : &run->own;
    run->balance.work = run->before.least = run->before.most = spec->work_start;
    run->balance.t = spec->t_start;
    run->bounds.now.most = spec->max_steps;
    run->choice.open = spec->open_integrator;
    run->stand_in = spec->stand_in;
    if (run->stand_in.active)
        run->choice.kind = kmp_solver_find(spec->integrator)->stand_in;
    if (!start) {
        status = kmp_assembly_at_start(system, &own);
        start = own;
    }
    if (status == KEMPE_OK)
        (void)kmp_doubt_shared_friction(system, spec->t_start, start->q);
    if (status == KEMPE_OK)
        status = find_time_scales(run);
    if (status == KEMPE_OK)
        status = kmp_runner_prepare(run, start);
    if (status == KEMPE_OK)
        log_loose(run, start);
    kempe_assembly_free(own);
    run->build_s = cpu_of(run) - begin_s;
    if (status != KEMPE_OK) {
        status = kmp_runner_give_up(run, status, "the run could not be prepared", spec->t_start);
    } else {
        status = kmp_runner_start(run, spec->t_start, run->formulation->y, run->formulation->yp, run->spec.first_step);
        run->events.t = spec->t_start;
        if (status == KEMPE_OK && run->events.tracker)
            status = kmp_event_tracker_begin(run->events.tracker, spec->t_start, &run->events.here);
        status = kmp_runner_give_up(run, status, "the right-hand side cannot be evaluated", spec->t_start);
    }
    return KMP_GIVE_IF(status == KEMPE_OK || status == KEMPE_E_FAILED || status == KEMPE_STOPPED, status, runner, run,
                       kmp_runner_free);
}

void kmp_runner_free(kmp_runner *run)
{
    if (!run)
        return;
    kmp_runner_release_integrators(run);
    kmp_runner_forget_visits(run);
    kmp_runner_free_sampler(run);
    kmp_delays_free(run);
    if (run->formulation)
        run->formulation->release(run->formulation);
    kmp_friction_release(run);
    kmp_friction_drop_kept(run);
    kmp_partition_free(&run->part);
    kmp_eval_free(run->eval);
    kmp_team_free(run->team);
    kmp_rank_margin_free(&run->margin);
    kmp_arena_free(&run->arena);
    kmp_free(run->reason);
    kmp_run_log_free(&run->own);
    kmp_free(run);
}

double kmp_runner_t(const kmp_runner *run)
{
    if (run->events.here)
        return run->events.t;
    return run->solver ? run->solver->t : run->balance.t;
}

bool kmp_runner_ended(const kmp_runner *run)
{
    return run->events.ended;
}

double kmp_runner_t_old(const kmp_runner *run)
{
    return run->solver ? run->solver->t_old : run->balance.t;
}

static void add_work(const kmp_solver *solver, kmp_run_report *report)
{
    kmp_solver_work w = solver->work;
    report->steps += w.steps;
    report->rejected += w.rejected;
    report->refused += w.refused;
    report->rhs += w.rhs;
    report->newton += w.newton;
    report->jacobians += w.matrices;
    report->factorizations += w.factorizations;
}

void kmp_runner_add_report(const kmp_runner *run, kmp_run_report *report)
{
    if (!run->solver)
        return;
    add_work(run->solver, report);
    if (run->choice.other)
        add_work(run->choice.other, report);
    report->newton += run->formulation->newton;
    report->factorizations += run->formulation->factorizations;
    report->exchanges += run->formulation->exchanges;
}

/* -- work of non-conservative forces where it is not an unknown of the formulation ---------------------- */

/* Power at the dense state in run->room.y, moving closures included. If it needs multipliers these come from the row.
 */
static double power_at(kmp_runner *run, double t)
{
    int n = run->s->n;
    double *row = run->balance.row, *lambda = row + 3 * n, work;
    bool requested = !run->method->dae || run->s->rheonomic || run->s->load_row_count > 0;
    requested = requested && kmp_formulation_row(run->formulation, t, run->room.y, row, &work) == KMP_GO;
    if (!run->method->dae && !requested)
        return NAN;
    const double *q = run->method->dae ? run->room.y : row;
    double power = kmp_eval_power(run->eval, t, q, q + n);
    if (!requested || !run->s->rheonomic)
        return power;
    kmp_eval_closure(run->eval, t, q);
    return power + kmp_eval_drive_power(run->eval, lambda);
}

/* Quadrature with Gauss's three points on the integrator's polynomial, from work_t to t within the last step. */
static kempe_status integrate_work(kmp_runner *run, double t)
{
    static const double node[3] = {-0.7745966692414834, 0, 0.7745966692414834};
    static const double weight[3] = {5.0 / 9, 8.0 / 9, 5.0 / 9};
    double a = run->balance.t, h = t - a;
    if (!run->room.yp || !run->s->dissipative || !(h > 0))
        return KEMPE_OK;
    for (int k = 0; k < 3; k++) {
        double at = a + 0.5 * h * (1 + node[k]);
        KMP_TRY(kmp_runner_dense(run, at));
        run->balance.work += 0.5 * h * weight[k] * power_at(run, at);
    }
    run->balance.t = t;
    return KEMPE_OK;
}

/* Notes the work up to the last step; rows may be far apart. */
static kempe_status note_work(kmp_runner *run)
{
    const kmp_ode *ode = &run->solver->ode;
    double work = run->balance.work;
    if (!run->s->dissipative || (!run->room.yp && ode->quadratures == 0))
        return KEMPE_OK;
    if (!run->room.yp) {
        KMP_TRY(kmp_runner_dense(run, run->solver->t));
        work = run->room.y[ode->n - 1];
    }
    run->before.least = fmin(run->before.least, work);
    run->before.most = fmax(run->before.most, work);
    return KEMPE_OK;
}

/* -- steps and rows ------------------------------------------------------------------------------------ */

/* Finds the event of the last step. A step with a kink beyond the event is made again, up to the event; one that has
 * passed a free kink, with the branch of its start. */
static kempe_status find_event(kmp_runner *run)
{
    kmp_solver *solver = run->solver;
    KMP_TRY(kmp_event_tracker_find(run->events.tracker, solver->t_old, solver->t, &run->events.t, &run->events.here));
    double h = 0;
    if (!run->kind->undo)
        return KEMPE_OK;
    if (run->events.here)
        h = kmp_event_tracker_shortens(run->events.tracker, solver->t_old, run->events.t, solver->t,
                                       run->kind->repeats);
    else if (!run->events.here && kmp_event_tracker_hold_passed(run->events.tracker))
        h = solver->t - solver->t_old;
    if (!(h > 0))
        return KEMPE_OK;
    run->events.here = false;
    run->kind->undo(solver, h);
    KMP_TRY(run->kind->step(solver));
    return kmp_event_tracker_find(run->events.tracker, solver->t_old, solver->t, &run->events.t, &run->events.here);
}

kempe_status kmp_runner_step(kmp_runner *run)
{
    double t = kmp_runner_t(run);
    kempe_status status = run->balance.t < t ? integrate_work(run, t) : KEMPE_OK;
    if (status == KEMPE_OK)
        status = kmp_runner_change(run, t);
    if (status == KEMPE_OK) {
        status = run->kind->step(run->solver);
        if (status == KEMPE_E_FAILED && kmp_interrupted(run->s->context))
            return interrupt(run);
        if (status == KEMPE_E_FAILED)
            status = kmp_runner_rescue(run, t);
    }
    if (status == KEMPE_OK && run->solver->t < kmp_runner_pause(run))
        run->stops.pace = 0;
    if (status == KEMPE_OK && run->events.tracker)
        status = find_event(run);
    /* Too little is left behind an event that differs from the end of the run by rounding. */
    if (status == KEMPE_OK && run->events.here && run->solver->t >= run->spec.t_end &&
        run->spec.t_end - run->events.t < kmp_step_least(run->spec.t_end))
        run->events.t = run->spec.t_end;
    if (status == KEMPE_OK)
        status = note_work(run);
    if (status == KEMPE_OK)
        status = kmp_friction_watch_shared(run, kmp_runner_t(run));
    if (status != KEMPE_OK)
        return kmp_runner_give_up(
            run, status, "the step size became too small: the motion is singular, or too fast for double precision", t);
    return attend(run);
}

kempe_status kmp_runner_cut(kmp_runner *run, double t, double stop)
{
    run->stops.at = stop;
    run->stops.anew = true;
    if (t == kmp_runner_t(run))
        return KEMPE_OK;
    run->events.here = false;
    kempe_status status = kmp_delays_record(run, t);
    kmp_delays_jump(run, 0);
    if (status == KEMPE_OK)
        status = kmp_runner_begin_anew(run, t);
    return kmp_runner_give_up(run, status, "the right-hand side cannot be evaluated", t);
}

kempe_status kmp_runner_inner_row(kmp_runner *run, double t, bool whole, double *row, double *work)
{
    const int n = run->s->n;
    kempe_status status = integrate_work(run, t);
    *work = 0;
    if (status != KEMPE_OK)
        return kmp_runner_give_up(run, status, "the state cannot be interpolated", t);
    if ((kmp_runner_dense(run, t) != KEMPE_OK ||
         run->formulation->row(run->formulation, t, run->room.y, row, row + n, whole ? row + 2 * n : NULL,
                               whole ? row + 3 * n : NULL, work) != KMP_GO) &&
        !kmp_runner_bridge(run, t, row, work))
        return kmp_runner_give_up(run, KEMPE_E_FAILED, "the state cannot be completed", t);
    if (run->room.yp)
        *work = run->balance.work;
    return KEMPE_OK;
}

/* -- rows that are read -------------------------------------------------------------------------------------------- */

void kmp_runner_keep(kmp_runner *run)
{
    kmp_runner_keep_loads(run, &run->room.before_rows);
}

kempe_status kmp_runner_give_back(kmp_runner *run, kempe_status status)
{
    kmp_runner_give_loads(run, &run->room.before_rows);
    return status;
}

kempe_status kmp_runner_motion(kmp_runner *run, double t, double *row)
{
    const int n = run->s->n;
    double work;
    memset(row + 2 * n, 0, (size_t)(n + run->s->m) * sizeof *row);
    kmp_runner_follow(run, t);
    kmp_runner_keep(run);
    KMP_TRY(kmp_runner_give_back(run, kmp_runner_inner_row(run, t, false, row, &work)));
    kmp_runner_show(run, row, row + n, row + 2 * n);
    return KEMPE_OK;
}

/* All of a row, with friction that sticks, in the user's coordinates. */
static kempe_status whole_row(kmp_runner *run, double t, double *row, double *work)
{
    const int n = run->s->n;
    KMP_TRY(kmp_runner_inner_row(run, t, true, row, work));
    if (run->sticking.friction)
        kmp_friction_show(run, t, row);
    kmp_runner_show(run, row, row + n, row + 2 * n);
    return KEMPE_OK;
}

kempe_status kmp_runner_row(kmp_runner *run, double t, double *row, double *work)
{
    kmp_runner_follow(run, t);
    kmp_runner_keep(run);
    return kmp_runner_give_back(run, whole_row(run, t, row, work));
}

kempe_status kmp_runner_look_inside(kmp_runner *run, double t, bool whole, double *row)
{
    const double work = run->balance.work, until = run->balance.t;
    double unused;
    run->balance.t = t;
    kmp_runner_keep(run);
    kempe_status status = kmp_runner_give_back(run, kmp_runner_inner_row(run, t, whole, row, &unused));
    run->balance.work = work;
    run->balance.t = until;
    return status;
}

kempe_status kmp_runner_look(kmp_runner *run, double t, double *row)
{
    const double work = run->balance.work, until = run->balance.t;
    double unused;
    run->balance.t = t;
    kmp_runner_keep(run);
    kempe_status status = kmp_runner_give_back(run, whole_row(run, t, row, &unused));
    run->balance.work = work;
    run->balance.t = until;
    return status;
}

const double *kmp_runner_unknowns(kmp_runner *run, double t)
{
    return kmp_runner_dense(run, t) == KEMPE_OK ? run->room.y : NULL;
}

void kmp_runner_report(const kmp_runner *run, kmp_run_report *report)
{
    kmp_runner_count(run, report);
    report->reason = run->reason ? kmp_strdup(run->reason) : NULL;
}

void kmp_runner_count(const kmp_runner *run, kmp_run_report *report)
{
    *report = run->before;
    report->rate_scale = run->rate_scale;
    report->build_s = run->build_s;
    report->cut = run->cut;
    report->prescribed = run->solver && run->part.p == 0 && !run->sticking.friction;
    report->ended = run->events.ended;
    report->requested = run->events.requested;
    report->t = run->solver ? kmp_runner_t(run) : run->spec.t_start;
    kmp_runner_add_report(run, report);
    report->centrings = run->centrings;
    report->integrator = kmp_runner_integrator(run)->name;
    report->continued = run->choice.left ? run->method->formulation : NULL;
    report->continued_t = run->choice.left_t;
    report->chosen_ratio = run->choice.ratio;
    report->events = run->events.tracker ? run->events.tracker->count : 0;
    report->impacts = run->sticking.impacts ? run->sticking.impacts->run.total : -1;
    report->changes = run->sticking.friction ? run->sticking.friction->past.total : -1;
}

/* -- a whole run ------------------------------------------------------------------------------------- */

/* The row of a time that may be beyond the last step by rounding: at a sample it has the values before it. */
static kempe_status deliver_at(kmp_runner *run, double t, double *row, kmp_row_fn *take, void *user)
{
    int n = run->s->n;
    double work;
    KMP_TRY(kmp_runner_row(run, fmin(t, kmp_runner_t(run)), row, &work));
    return take(user, t, row, row + n, row + 2 * n, row + 3 * n, work) ? kmp_fail_memory(run->s->context) : KEMPE_OK;
}

/* Delivers rows within the last step, and the one at which a condition has ended the run. */
static kempe_status deliver(kmp_runner *run, int *next, double *row, kmp_row_fn *take, void *user)
{
    double t = kmp_runner_t(run);
    for (; *next < run->spec.time_count && run->spec.times[*next] <= kmp_runner_reach(run, t); ++*next)
        KMP_TRY(deliver_at(run, run->spec.times[*next], row, take, user));
    bool more = *next < run->spec.time_count && (*next == 0 || run->spec.times[*next - 1] < t);
    return run->events.ended && more ? deliver_at(run, t, row, take, user) : KEMPE_OK;
}

/* Steps between two readings of the processor clock, each of which costs as much as a short step. */
enum { UNWATCHED = 32 };

/* Ends a run that has exceeded its time limit. */
static kempe_status watch(kmp_runner *run, double begin_s, int *steps)
{
    if (!(run->spec.limit_s > 0) || ++*steps < UNWATCHED)
        return KEMPE_OK;
    *steps = 0;
    if (cpu_of(run) - begin_s <= run->spec.limit_s)
        return KEMPE_OK;
    kmp_text text = {0};
    kmp_text_printf(&text, "stopped at t = %.6g s after %.3g s of processor time", kmp_runner_t(run),
                    run->spec.limit_s);
    run->reason = kmp_text_take(&text);
    run->cut = true;
    return run->reason ? KEMPE_STOPPED : kmp_fail_memory(run->s->context);
}

static kempe_status record(kmp_runner *run)
{
    return run->spec.recording ? kmp_recording_add(run->spec.recording, run) : KEMPE_OK;
}

static kempe_status advance(kmp_runner *run, kmp_row_fn *take, void *user)
{
    int next = 0, steps = 0;
    double begin_s = run->spec.limit_s > 0 ? cpu_of(run) : 0;
    double *row = KMP_ARENA_NEW(&run->arena, double, 3 * run->s->n + run->s->m);
    KMP_TRY(kmp_made(run->s->context, row));
    KMP_TRY(deliver(run, &next, row, take, user));
    KMP_TRY(record(run));
    while (kmp_runner_t(run) < run->spec.t_end) {
        kempe_status status = kmp_runner_step(run);
        if (status == KEMPE_OK || status == KEMPE_STOPPED)
            KMP_TRY(record(run));
        if (status == KEMPE_OK && run->spec.step &&
            run->spec.step(run->spec.user, run, kmp_runner_t_old(run), kmp_runner_t(run)))
            status = kmp_runner_give_up(run, KEMPE_E_FAILED, "the state cannot be interpolated", kmp_runner_t(run));
        if (status == KEMPE_OK)
            status = watch(run, begin_s, &steps);
        if (status == KEMPE_OK || status == KEMPE_STOPPED)
            KMP_TRY(deliver(run, &next, row, take, user));
        KMP_TRY(status);
    }
    return KEMPE_OK;
}

/* Completes the past of delayed signals up to the end, and copies it to the caller. */
static kempe_status give_past(kmp_runner *run, kempe_status status, kmp_program_cache_past *kept)
{
    kempe_status recalled = KEMPE_OK;
    bool any = run && kept->past;
    if (any && (status == KEMPE_OK || status == KEMPE_STOPPED))
        recalled = kmp_delays_record(run, kmp_runner_t(run));
    kept->past = any ? kmp_past_copy(kept->past) : NULL;
    if (any)
        KMP_TRY(kmp_made(run->s->context, kept->past));
    return recalled == KEMPE_OK ? status : recalled;
}

kempe_status kmp_run_whole(const kempe_system *system, const kmp_run_spec *spec, const kempe_assembly *start,
                           kmp_row_fn *row, void *user, kmp_run_report *report)
{
    kmp_runner *run = NULL;
    *report = (kmp_run_report){.t = spec->t_start};
    const size_t heap = spec->parts > 0 ? 0 : kmp_heap_in_use(); /* which takes as long as the run of a small part */
    kempe_status status = kmp_runner_new(system, spec, start, &run);
    double begin_s = cpu_of(run), wall_s = kmp_wall_now();
    if (status == KEMPE_OK && run)
        status = advance(run, row, user);
    double cpu_s = cpu_of(run) - begin_s;
    wall_s = kmp_wall_now() - wall_s;
    if (run)
        kmp_runner_report(run, report);
    if (spec->kept_past)
        status = give_past(run, status, spec->kept_past);
    report->cpu_s = cpu_s;
    report->wall_s = run && run->team ? wall_s : 0;
    report->heap = heap > 0 ? kmp_heap_in_use() - heap : 0;
    if (spec->recording)
        kmp_recording_take(spec->recording, run);
    else
        kmp_runner_free(run);
    return status;
}

kempe_status kmp_run_goes_apart(const kempe_system *system, const kmp_run_spec *spec, bool *apart)
{
    const struct kmp_island_systems *parts = NULL;
    KMP_TRY(kmp_island_systems_of(system, spec, &parts));
    *apart = parts || kmp_near_may_pay(system, spec);
    return KEMPE_OK;
}

kempe_status kmp_run(const kempe_system *system, const kmp_run_spec *spec, const kempe_assembly *start, kmp_row_fn *row,
                     void *user, kmp_run_report *report)
{
    const struct kmp_island_systems *parts = NULL;
    kempe_assembly *own = NULL;
    *report = (kmp_run_report){.t = spec->t_start};
    KMP_TRY(kmp_island_systems_of(system, spec, &parts));
    if (!parts && !kmp_near_may_pay(system, spec))
        return kmp_run_whole(system, spec, start, row, user, report);
    kempe_status status = start ? KEMPE_OK : kmp_assembly_at_start(system, &own);
    if (status == KEMPE_OK && parts)
        status = kmp_island_runs(parts, system, spec, start ? start : own, kmp_near_run, row, user, report);
    else if (status == KEMPE_OK)
        status = kmp_near_run(system, spec, start ? start : own, row, user, report);
    kempe_assembly_free(own);
    return status;
}
