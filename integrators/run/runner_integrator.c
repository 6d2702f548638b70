/* SPDX-License-Identifier: BSD-3-Clause */
/* The integrator of a run. If the user chose none, the reduced formulation begins with the one of less counted time
 * (cost_model.h), and later tries the other: the one with more time simulated in a counted cycle continues. A trial is
 * part of the run. No clock decides, so the same input has the same result. */
#include "integrators/run/runner_integrator.h"
#include "integrators/formulations/cost_model.h"
#include "integrators/run/methods.h"
#include "integrators/run/runner.h"
#include "integrators/run/runner_start.h"
#include "integrators/steppers/singular_step.h"

#include <math.h>

/* Steps until the first trial, before which the present integrator is measured, and of the trial itself, without the
 * steps at its beginning. */
enum { FIRST_TRIAL = 200, MEASURED = 40, TRIAL = 12, SETTLE = 3 };
/* A trial, with what it makes, must cost no more than this part of the rest of the run. Far below
 * this share the first one begins early: an explicit method whose steps are short may be limited by stability. */
static const double TRIAL_SHARE = 0.1, EARLY_SHARE = 0.03;
enum { EARLY = 16 };
/* An explicit method that takes this many times the expected steps is limited by stability, or by a motion that changes
 * fast: a trial after 16, 32, 64 steps may then take this part of the rest of the run, unless more than this
 * ratio is expected. Without lanes a step of radau takes three times as long. */
static const double MANY_STEPS = 2.5, MANY_ONE_BY_ONE = 7.5, LIMITED_SHARE = 0.4, HOPELESS = 1.3;
/* A successful trial simulates this many times as much in a cycle: at the same tolerance errors of radau are smaller,
 * and are worth 1.3 times the steps of dop853 in the mean over the bench set. A trial that ends early must be clear. */
static const double BETTER_RADAU = 1 / KMP_RATIO_WORTH, BETTER_DOP853 = 1.6, CLEARLY_BETTER = 2;
/* Steps of radau over steps of dop853 at the beginning of a trial. */
static const double LONGER = 1.5;

bool kmp_runner_is_followed(const kmp_runner *run)
{
    return run->part.p == 0 && !run->method->dae;
}

/* While friction is regularised the equations are stiff: an implicit integrator takes the place of an explicit one. */
const kmp_solver_kind *kmp_runner_integrator(const kmp_runner *run)
{
    const kmp_solver_kind *kind = run->choice.kind ? run->choice.kind : kmp_solver_find(run->spec.integrator);
    bool stiff = kmp_friction_is_smooth(run->sticking.friction) && !run->method->dae && !(run->spec.fixed_step > 0);
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

/* True while an integrator of lanes waits until these pay in the present formulation. */
static bool waits_for_lanes(const kmp_runner *run)
{
    return run->choice.open && run->choice.waits && kmp_runner_integrator(run)->lanes;
}

/* Steps across change points have their own integrator, and following the closures corrects every step. A formulation
 * that may last for a few steps only makes no lanes at once. */
const kmp_solver_kind *kmp_runner_begins_with(const kmp_runner *run)
{
    const kmp_solver_kind *requested = kmp_runner_integrator(run);
    bool cannot = (requested->dae || requested->implicit || !requested->corrects) && kmp_runner_is_followed(run);
    if (run->change_point.near && !run->change_point.walks)
        return &kmp_solver_singular_step;
    return cannot || run->change_point.near || waits_for_lanes(run) ? kmp_solver_find("dop853") : requested;
}

static double cycles_of_both(const kmp_runner *run)
{
    const kmp_solver *other = run->choice.other;
    return run->solver->cycles + (other ? other->cycles : 0);
}

static long steps_of_both(const kmp_runner *run)
{
    const kmp_solver *other = run->choice.other;
    return run->solver->work.steps + (other ? other->work.steps : 0);
}

static void begin_visit(kmp_runner *run, double t)
{
    kmp_integrator_choice *c = &run->choice;
    c->since = cycles_of_both(run);
    c->since_t = t;
    c->since_steps = steps_of_both(run);
}

/* Begins to count the time that lanes may save with the present unknowns. */
static void begin_count(kmp_runner *run)
{
    kmp_integrator_choice *c = &run->choice;
    begin_visit(run, kmp_runner_t(run));
    c->from = c->since;
    c->from_t = c->since_t;
}

/* The rest of the run over its part from `begin` to t. */
static double rest_over(const kmp_runner *run, double begin, double t)
{
    return (run->spec.t_end - t) / (t - begin);
}

/* True if lanes have saved what it takes to make them, or would have, since this number of cycles at a time. The time
 * that the present unknowns have lasted is the forecast of how long they, or the next ones, will last, at most to the
 * end of the run. */
static bool lanes_pay_since(const kmp_runner *run, double cycles, double t)
{
    const kmp_integrator_choice *c = &run->choice;
    double spent = cycles_of_both(run) - cycles, rest = rest_over(run, t, kmp_runner_t(run));
    return spent * fmin(1, rest) >= (run->kind->lanes ? c->price_in_lanes : c->price);
}

static bool lanes_pay(const kmp_runner *run)
{
    return lanes_pay_since(run, run->choice.from, run->choice.from_t);
}

static double pace(const kmp_runner *run, double t)
{
    return (t - run->choice.t) / (run->solver->cycles - run->choice.cycles);
}

/* True if the trial has simulated this multiple of the time in a cycle as before it. */
static bool trial_wins(kmp_runner *run, double t, double times)
{
    const kmp_integrator_choice *c = &run->choice;
    const double now = pace(run, t);
    if (!(now > times * c->pace))
        return false;
    kmp_run_log_add(run->log, "integrator", t, c->pace / now, 1,
                    "integrator changed from %s to %s: about %.3g times as fast here%s", c->other_kind->name,
                    run->kind->name, now / c->pace, now < c->pace ? ", with smaller errors" : "");
    return true;
}

/* A trial that unknowns do not outlast has no result, unless it is clear before the last step. */
static bool give_up_trial(kmp_runner *run)
{
    kmp_integrator_choice *c = &run->choice;
    const bool runs = c->trial == KMP_TRIAL_BEGINS ||
                      (c->trial == KMP_TRIAL_RUNS && !trial_wins(run, kmp_runner_t(run), CLEARLY_BETTER));
    c->kind = runs ? c->other_kind : c->kind;
    c->trial = KMP_TRIAL_LATER;
    return runs;
}

bool kmp_runner_leaves_unknowns(kmp_runner *run, double t)
{
    kmp_integrator_choice *c = &run->choice;
    const kmp_solver_kind *kind = waits_for_lanes(run) ? c->kind : run->kind;
    const bool steady = !run->sticking.friction && !run->sticking.impacts && !run->s->switches &&
                        run->s->load_row_count == 0; /* for which `projected` has no lanes */
    const bool wished = !run->spec.open || run->spec.kind || run->method->dae;
    if (!run->formulation->due || !kind->lanes || !c->open || wished || !steady || run->change_point.near ||
        c->trial >= KMP_TRIAL_BEGINS)
        return false;
    double spent = cycles_of_both(run) - c->from;
    if (spent * rest_over(run, c->from_t, t) < run->formulation->ode.cycles_to_make)
        return false;
    c->open = false;
    c->left = run->method;
    c->left_t = t;
    c->kind = kind;
    return true;
}

bool kmp_runner_takes_unknowns_again(kmp_runner *run)
{
    if (!run->choice.left || !run->formulation->one_by_one || run->change_point.near)
        return false;
    run->method = run->choice.left;
    run->choice.left = NULL;
    return true;
}

void kmp_runner_end_formulation(kmp_runner *run)
{
    kmp_integrator_choice *c = &run->choice;
    run->brief = !run->formulation->due && steps_of_both(run) - c->since_steps < KMP_FORMULATION_BRIEF;
    c->waits = run->brief || !lanes_pay_since(run, c->since, c->since_t);
    give_up_trial(run);
}

void kmp_runner_end_unknowns(kmp_runner *run)
{
    run->formulation->spares = run->choice.open && run->kind->lanes && !lanes_pay(run);
}

double kmp_runner_length(const kmp_runner *run, double t)
{
    return run->rate_scale * (run->spec.t_end - t);
}

kempe_status kmp_runner_make_integrator(kmp_runner *run)
{
    const kmp_ode *ode = &run->formulation->ode;
    kmp_integrator_choice *c = &run->choice;
    if (c->open && !c->kind && !run->change_point.near) { /* lanes are there where they are worth while */
        c->kind = kmp_solver_find(ode->lanes ? "radau" : run->spec.integrator);
        const double length = kmp_runner_length(run, run->spec.t_start);
        c->ratio = ode->cycles_of_lanes > 0 ? kmp_cycles_ratio(ode, run->spec.rtol, length) : 0;
        c->patience = FIRST_TRIAL;
    }
    if (c->open && run->change_point.near) { /* errors of radau were 600 times the tolerance, of dop853 15 times */
        if (c->kind && c->kind->lanes)
            kmp_run_log_add(run->log, "integrator", run->change_point.since, 0, 0,
                            "integrator changed from radau to dop853: the motion passes change points");
        c->kind = kmp_solver_find("dop853");
        c->open = false;
    }
    c->trial = KMP_TRIAL_LATER;
    c->next = c->patience - MEASURED;
    run->kind = kmp_runner_begins_with(run);
    if (ode->n == 0 && !run->kind->dae && !run->kind->lanes) /* vectors of SUNDIALS have at least one value */
        run->kind = kmp_solver_find("dop853");
    run->solver = new_solver(run, run->kind);
    if (!run->solver)
        return KEMPE_E_FAILED;
    if (c->open) {
        double ratio = kmp_cycles_ratio(ode, run->spec.rtol, INFINITY);
        c->price = kmp_cycles_until_lanes_pay(ode, ratio);
        c->price_in_lanes = fmin(ratio, 1) * c->price;
        begin_count(run);
    }
    return KEMPE_OK;
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

/* Takes the resting integrator, or a new one, which may need lanes. */
static kempe_status take_other(kmp_runner *run, double t)
{
    kmp_integrator_choice *c = &run->choice;
    const kmp_ode *ode = &run->formulation->ode;
    const kmp_solver_kind *before = run->kind, *kind = kmp_solver_find(before->lanes ? "dop853" : "radau");
    kmp_solver *solver = c->other;
    if (kind->lanes && ode->make_lanes && ode->make_lanes(ode->self, t) != KMP_GO)
        return KEMPE_E_FAILED;
    if (!solver && !(solver = new_solver(run, kind)))
        return KEMPE_E_FAILED;
    c->other = run->solver;
    c->other_kind = before;
    run->kind = kind;
    run->solver = solver;
    return KEMPE_OK;
}

/* Continues at t with the other integrator, with a step h. */
static kempe_status exchange(kmp_runner *run, double t, double h)
{
    KMP_TRY(kmp_runner_dense(run, t));
    KMP_TRY(take_other(run, t));
    run->choice.kind = run->kind;
    return kmp_runner_start(run, t, run->room.y, run->room.yp, h);
}

static void measure_from(kmp_runner *run, double t, kmp_trial trial, long steps)
{
    kmp_integrator_choice *c = &run->choice;
    c->trial = trial;
    c->t = t;
    c->cycles = run->solver->cycles;
    c->next = run->solver->work.steps + steps;
}

static void wait(kmp_runner *run, double t)
{
    measure_from(run, t, KMP_TRIAL_LATER, run->choice.patience);
}

bool kmp_runner_suits(const kmp_runner *run, const kmp_visit *visit)
{
    return run->choice.open ? !kmp_runner_integrator(run)->implicit : kmp_runner_begins_with(run) == visit->kind;
}

/* Lanes that the formulation has are used at once; others wait until all visits pay them. */
kempe_status kmp_runner_return_to_integrator(kmp_runner *run, double t, const kmp_visit *visit)
{
    kmp_integrator_choice *c = &run->choice;
    run->kind = visit->kind;
    run->solver = visit->solver;
    c->other = visit->choice.other;
    c->other_kind = visit->choice.other_kind;
    c->waits = !run->formulation->ode.lanes;
    c->price = visit->choice.price;
    c->price_in_lanes = visit->choice.price_in_lanes;
    c->from = visit->choice.from;
    c->from_t = visit->choice.from_t + t - visit->t;
    c->trial = KMP_TRIAL_LATER;
    c->next = visit->choice.next;
    if (c->open && kmp_runner_begins_with(run) != run->kind)
        KMP_TRY(take_other(run, t));
    begin_visit(run, t);
    return KEMPE_OK;
}

kempe_status kmp_runner_begin_unknowns(kmp_runner *run, double t, double *h)
{
    kmp_integrator_choice *c = &run->choice;
    if (run->formulation->lacks_lanes && run->kind->lanes) {
        c->waits = !give_up_trial(run);
        *h /= LONGER;
        KMP_TRY(take_other(run, t));
        wait(run, t);
    }
    begin_count(run);
    return KEMPE_OK;
}

/* The cost of a trial, including the lanes that it may have to make, divided by the cost of the rest of the run. */
static double share_of_trial(const kmp_runner *run, double t)
{
    const kmp_solver *solver = run->solver;
    double rest = rest_over(run, run->choice.from_t, t), steps = (double)solver->work.steps;
    double made = run->kind->lanes || run->choice.other ? 0 : run->formulation->ode.cycles_to_make;
    return ((SETTLE + TRIAL) / steps + made / (solver->cycles - run->choice.from)) / rest;
}

static bool takes_many_steps(const kmp_runner *run, double t)
{
    const double length = run->rate_scale * (t - run->choice.from_t);
    const double many = run->formulation->ode.make_lanes ? MANY_STEPS : MANY_ONE_BY_ONE;
    return !run->kind->lanes && run->choice.ratio < HOPELESS &&
           (double)run->solver->work.steps > many * kmp_steps_expected(run->spec.rtol, length);
}

/* True if the first trial begins before FIRST_TRIAL steps. */
static bool tries_early(const kmp_runner *run, double t)
{
    const long steps = run->solver->work.steps;
    if (run->kind->lanes || run->choice.trial != KMP_TRIAL_LATER || steps < EARLY || (steps & (steps - 1)) != 0)
        return false;
    const double share = share_of_trial(run, t);
    return (steps == EARLY && share < EARLY_SHARE) || (takes_many_steps(run, t) && share < LIMITED_SHARE);
}

/* Newton's method has no rival among explicit methods. A trial that the rest of the run does not pay is left out. */
static kempe_status begin_trial(kmp_runner *run, double t)
{
    kmp_integrator_choice *c = &run->choice;
    double h = run->solver->h;
    c->patience *= 2;
    const bool limited = takes_many_steps(run, t);
    if (run->solver->stiff || share_of_trial(run, t) > (limited ? LIMITED_SHARE : TRIAL_SHARE) ||
        (!run->formulation->ode.make_lanes && !limited)) { /* without lanes radau gains where it is limited only */
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
    if (!trial_wins(run, t, run->kind->lanes ? BETTER_RADAU : BETTER_DOP853))
        KMP_TRY(exchange(run, t, c->h));
    wait(run, t);
    return KEMPE_OK;
}

kempe_status kmp_runner_try_integrator(kmp_runner *run, double t)
{
    kmp_integrator_choice *c = &run->choice;
    if (!c->open || !c->kind || !(t > kmp_runner_t_old(run)))
        return KEMPE_OK;
    if (waits_for_lanes(run) && !run->change_point.near && run->formulation->ode.make_lanes) {
        if (lanes_pay(run)) {
            c->waits = false;
            KMP_TRY(exchange(run, t, run->solver->h * LONGER));
            wait(run, t);
        }
        return KEMPE_OK;
    }
    if (run->solver->work.steps < c->next && !tries_early(run, t))
        return KEMPE_OK;
    if (run->method->dae || run->change_point.near || run->kind != c->kind) {
        c->next = run->solver->work.steps + FIRST_TRIAL;
        return KEMPE_OK;
    }
    switch (c->trial) {
    case KMP_TRIAL_LATER:
        measure_from(run, t, KMP_TRIAL_BEFORE, takes_many_steps(run, t) ? TRIAL : MEASURED);
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
