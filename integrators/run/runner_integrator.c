/* SPDX-License-Identifier: BSD-3-Clause */
/* The integrator of a run. If the user chose none, the reduced formulation begins with the one of less counted time
 * (cost_model.h), and later tries the other: that with more time simulated in a counted cycle continues. A trial is
 * part of the run. No clock decides, so the same input has the same result. */
#include "integrators/run/runner_integrator.h"
#include "integrators/formulations/cost_model.h"
#include "integrators/run/runner.h"
#include "integrators/run/runner_start.h"
#include "integrators/steppers/singular_step.h"
#include "model/data/model.h"

#include <math.h>

/* Steps until the first trial, before which the present integrator is measured, and of the trial itself, without those
 * at its beginning. */
enum { FIRST_TRIAL = 200, MEASURED = 40, TRIAL = 12, SETTLE = 3 };
/* A successful trial simulates this many times as much in a cycle: at the same tolerance errors of radau are smaller,
 * and are worth 1.3 times the steps of dop853 in the mean over the bench set. */
static const double BETTER_RADAU = 1, BETTER_DOP853 = 1.4;
/* Steps of radau over those of dop853 at the beginning of a trial. */
static const double LONGER = 1.5;

bool kmp_runner_is_followed(const kmp_runner *run)
{
    return run->part.p == 0 && !run->method->dae;
}

/* While friction is regularised the equations are stiff: an implicit integrator takes the place of an explicit one. */
const kmp_solver_kind *kmp_runner_integrator(const kmp_runner *run)
{
    const kmp_solver_kind *kind = run->choice.kind ? run->choice.kind : kmp_solver_find(run->spec.integrator);
    bool stiff = kmp_friction_is_smooth(run->friction) && !run->method->dae && !(run->spec.fixed_step > 0);
    if (!stiff || kind->implicit || kind->lanes)
        return kind;
    return kmp_solver_find(run->method->jacobian ? "radau5" : "radau");
}

/* -- making -------------------------------------------------------------------------------------------- */

static kmp_solver *new_solver(const kmp_runner *run, const kmp_solver_kind *kind)
{
    const kmp_formulation *formulation = run->formulation;
    const kmp_solver_setup setup = {
        .context = run->s->context,
        .ode = &formulation->ode,
        .dae = &formulation->dae,
        .tolerance = {formulation->rtol > 0 ? formulation->rtol : run->spec.rtol, formulation->atol},
        .linear = run->spec.linear,
        .fixed_step = run->spec.fixed_step};
    return kind->create(kind, &setup);
}

bool kmp_runner_makes_lanes(const kmp_runner *run)
{
    return kmp_runner_integrator(run)->lanes && !(run->choice.open && run->brief);
}

/* Steps across change points have their own integrator, and following the closures corrects every step. */
static const kmp_solver_kind *integrator_of(const kmp_runner *run)
{
    const kmp_solver_kind *requested = kmp_runner_integrator(run);
    bool cannot = (requested->dae || requested->implicit || !requested->corrects) && kmp_runner_is_followed(run);
    bool brief = requested->lanes && !kmp_runner_makes_lanes(run);
    if (run->near_singular && !run->walks)
        return &kmp_solver_singular_step;
    return cannot || run->near_singular || brief ? kmp_solver_find("dop853") : requested;
}

/* The formulation has made lanes where they are worth while. */
static void choose_first(kmp_runner *run)
{
    const kmp_ode *ode = &run->formulation->ode;
    kmp_integrator_choice *c = &run->choice;
    const kempe_model *model = run->s->model;
    /* The force of a compliant contact begins and ends as a power of time, 1.5 in general. Steps are short there, and
     * radau gains nothing by its higher order. */
    bool rough = false;
    for (int k = 0; k < model->force_count; k++)
        rough = rough || model->forces[k].kind == KMP_FORCE_COMPLIANT;
    c->kind = kmp_solver_find(rough ? "dop853" : ode->lanes ? "radau" : run->spec.integrator);
    c->ratio = ode->cycles_of_lanes > 0 && !rough ? kmp_cycles_ratio(ode, run->spec.rtol) : 0;
    c->patience = FIRST_TRIAL;
}

/* Beside change points errors of radau were 600 times the tolerance where those of dop853 were 15 times. */
static void choose_for_change_points(kmp_runner *run)
{
    kmp_integrator_choice *c = &run->choice;
    if (c->kind && c->kind->lanes)
        kmp_run_log_add(run->log, "integrator", run->near_singular_t, 0, 0,
                        "dop853 continues in place of radau: the motion passes change points");
    c->kind = kmp_solver_find("dop853");
    c->open = false;
}

kempe_status kmp_runner_make_integrator(kmp_runner *run)
{
    if (run->choice.open && !run->choice.kind && !run->near_singular)
        choose_first(run);
    if (run->choice.open && run->near_singular)
        choose_for_change_points(run);
    run->choice.trial = KMP_TRIAL_LATER;
    run->choice.next = run->choice.patience - MEASURED;
    run->kind = integrator_of(run);
    run->solver = new_solver(run, run->kind);
    return run->solver ? KEMPE_OK : KEMPE_E_FAILED;
}

void kmp_runner_release_integrators(kmp_runner *run)
{
    if (run->choice.other)
        run->choice.other_kind->release(run->choice.other);
    if (run->solver)
        run->kind->release(run->solver);
    run->choice.other = NULL;
    run->solver = NULL;
}

/* -- trials -------------------------------------------------------------------------------------------- */

/* Continues at t with the resting integrator, or a new one, with a step h. */
static kempe_status exchange(kmp_runner *run, double t, double h)
{
    kmp_integrator_choice *c = &run->choice;
    kmp_formulation *formulation = run->formulation;
    const kmp_solver_kind *before = run->kind, *kind = kmp_solver_find(before->lanes ? "dop853" : "radau");
    kmp_solver *solver = c->other;
    KMP_TRY(run->kind->dense(run->solver, t, run->y, run->yp));
    if (!solver && kind->lanes && formulation->ode.make_lanes &&
        formulation->ode.make_lanes(formulation->ode.self, t) != KMP_GO)
        return KEMPE_E_FAILED;
    if (!solver && !(solver = new_solver(run, kind)))
        return KEMPE_E_FAILED;
    c->other = run->solver;
    c->other_kind = before;
    c->kind = run->kind = kind;
    run->solver = solver;
    return kmp_runner_start(run, t, run->y, run->yp, h);
}

static void measure_from(kmp_runner *run, double t, kmp_trial trial, long steps)
{
    kmp_integrator_choice *c = &run->choice;
    c->trial = trial;
    c->t = t;
    c->cycles = run->solver->cycles;
    c->next = run->solver->work.steps + steps;
}

static double pace(const kmp_runner *run, double t)
{
    return (t - run->choice.t) / (run->solver->cycles - run->choice.cycles);
}

static void wait(kmp_runner *run, double t)
{
    measure_from(run, t, KMP_TRIAL_LATER, run->choice.patience);
}

/* Newton's method has no rival among explicit methods. */
static kempe_status begin_trial(kmp_runner *run, double t)
{
    kmp_integrator_choice *c = &run->choice;
    double h = run->solver->h;
    c->patience *= 2;
    if (run->solver->stiff) {
        wait(run, t);
        return KEMPE_OK;
    }
    c->pace = pace(run, t);
    c->h = h;
    KMP_TRY(exchange(run, t, run->kind->lanes ? h / LONGER : h * LONGER));
    measure_from(run, t, KMP_TRIAL_BEGINS, SETTLE);
    return KEMPE_OK;
}

static kempe_status end_trial(kmp_runner *run, double t)
{
    kmp_integrator_choice *c = &run->choice;
    double now = pace(run, t);
    if (now > (run->kind->lanes ? BETTER_RADAU : BETTER_DOP853) * c->pace) {
        kmp_run_log_add(run->log, "integrator", t, c->pace / now, 1,
                        "%s continues in place of %s: it simulates %.3g times as much in the same counted time",
                        run->kind->name, c->other_kind->name, now / c->pace);
    } else {
        KMP_TRY(exchange(run, t, c->h));
    }
    wait(run, t);
    return KEMPE_OK;
}

kempe_status kmp_runner_try_integrator(kmp_runner *run, double t)
{
    kmp_integrator_choice *c = &run->choice;
    if (!c->open || !(t > kmp_runner_t_old(run)) || run->solver->work.steps < c->next)
        return KEMPE_OK;
    if (!run->formulation->ode.make_lanes || run->near_singular || run->kind != c->kind) {
        c->next = run->solver->work.steps + FIRST_TRIAL;
        return KEMPE_OK;
    }
    switch (c->trial) {
    case KMP_TRIAL_LATER:
        measure_from(run, t, KMP_TRIAL_BEFORE, MEASURED);
        return KEMPE_OK;
    case KMP_TRIAL_BEFORE:
        return begin_trial(run, t);
    case KMP_TRIAL_BEGINS:
        measure_from(run, t, KMP_TRIAL_RUNS, TRIAL);
        return KEMPE_OK;
    default:
        return end_trial(run, t);
    }
}
