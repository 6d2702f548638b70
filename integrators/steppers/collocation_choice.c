/* SPDX-License-Identifier: BSD-3-Clause */
/* The choice of the iteration for the stages, from step to step: by contraction, and by the time simulated in a counted
 * processor cycle. */
#include "integrators/steppers/collocation_choice.h"
#include "integrators/steppers/collocation.h"

#include <math.h>

/* Contraction of Picard's iteration that the next step aims at. */
static const double CONTRACTS = 0.3;
/* The next iteration is tried when the error permits steps WORTH times as long as this one for the cycles of a step,
 * SEVERAL times, which do not grow by HELD; Picard's returns when that contracts by EASY, SEVERAL times. A trial has
 * TRIAL steps. After one without success the next is twice as late. */
static const double WORTH = 1.3, EASY = 0.1, HELD = 1.2;
enum { SEVERAL = 3, TRIAL = 5, TRUST = 40, MOST_PATIENCE = 1000 };
/* Places are nearby where the first correction is less than this part of the values. */
static const double NEAR = 0.02;
/* Weight of the steps before in the pace of an iteration; steps longer by GROWS than the last one begin a new pace. The
 * costlier iteration must be BETTER: its longer steps have larger errors at the same tolerance. */
static const double FADES = 0.95, GROWS = 1.5, BETTER = 1.1;
/* Growth of the bound on steps after an iteration that failed; and where the iteration contracts by SURE. */
static const double RECOVERS = 1.1, RECOVERS_SURELY = 2, SURE = 0.01;
/* Cycles of an exact Jacobian over those of an evaluation, about. */
static const double EXACT = 3;

bool kmp_collocation_in_lanes(const kmp_collocation *s)
{
    return s->base.ode.lanes && s->base.ode.width == s->w;
}

/* The program of all stages, and sums over the stages. */
double kmp_collocation_sweep_cost(const kmp_collocation *s)
{
    const kmp_ode *ode = &s->base.ode;
    bool lanes = kmp_collocation_in_lanes(s) && ode->cycles_of_lanes > 0;
    return (lanes ? ode->cycles_of_lanes : s->s * ode->cycles) + KMP_SWEEP_CYCLES_OF_UNKNOWN * (s->p + s->inner);
}

/* The next two are fitted to measured cycles of systems of 1 to 63 unknowns, 7 stages. */
double kmp_collocation_correction_cost(const kmp_collocation *s, kmp_iteration iteration)
{
    double n = s->inner, count = n * s->s, rows = n * s->w / 8;
    return iteration == KMP_ITERATION_PICARD   ? 0
           : iteration == KMP_ITERATION_NEWTON ? 60 + 8 * n * n + 8 * count
                                               : 60 + 3.4 * count * rows;
}

double kmp_collocation_matrix_cost(const kmp_collocation *s, kmp_iteration iteration)
{
    double n = s->inner, count = n * s->s, rows = n * s->w / 8;
    return iteration == KMP_ITERATION_PICARD   ? 0
           : iteration == KMP_ITERATION_NEWTON ? 500 + 10 * n * n + 1.7 * n * n * n
                                               : count * (100 + 21 * rows + 2.1 * count * rows);
}

double kmp_collocation_jacobian_cost(const kmp_collocation *s)
{
    double columns = ceil((s->p + s->inner) / (s->w - 1.0)), sweep = kmp_collocation_sweep_cost(s);
    return s->whole ? sweep + EXACT * s->base.ode.cycles : columns * sweep;
}

/* -- choice -------------------------------------------------------------------------------------------- */

/* The length at which an iteration contracts well, from its contraction in a step h. */
static double length_of(const kmp_collocation *s, double h, double contraction)
{
    double fresh = s->iteration == KMP_ITERATION_NEWTON ? contraction / (2 * s->age + 1) : contraction;
    bool measured = s->iteration != KMP_ITERATION_COUPLED && fresh > 0;
    return measured ? h * fmax(0.5, sqrt(CONTRACTS / fresh)) : INFINITY;
}

double kmp_collocation_longest(kmp_collocation *s, double h)
{
    double fresh = s->iteration == KMP_ITERATION_NEWTON ? s->contraction / (2 * s->age + 1) : s->contraction;
    double most = length_of(s, h, s->contraction);
    if (s->ceiling > 0) {
        most = fmin(most, s->ceiling);
        s->ceiling *= fresh < SURE ? RECOVERS_SURELY : RECOVERS;
    }
    return most;
}

static void change_iteration(kmp_collocation *s, kmp_iteration to)
{
    s->iteration = to;
    s->trial_steps = s->limited = s->free = 0;
    s->trust = TRUST;
    s->ceiling = 0;
    s->has_jacobian = s->fresh = s->factored = false;
}

void kmp_collocation_begin_with(kmp_collocation *s, kmp_iteration iteration)
{
    for (int k = 0; k < KMP_ITERATIONS; k++)
        s->patience[k] = SEVERAL;
    s->simulated[iteration] = s->spent[iteration] = 0;
    change_iteration(s, iteration);
}

/* Tries an iteration, and judges the trial after some steps. */
static void try_iteration(kmp_collocation *s, kmp_iteration to)
{
    s->before = s->iteration;
    change_iteration(s, to);
    s->simulated[to] = s->spent[to] = 0;
    s->trial_steps = TRIAL;
}

/* Returns to the iteration before, whose next trial is later. */
static void end_trial(kmp_collocation *s)
{
    int *patience = &s->patience[s->iteration];
    *patience = *patience < MOST_PATIENCE ? 2 * *patience : MOST_PATIENCE;
    change_iteration(s, s->before);
    s->trust = *patience * TRUST / SEVERAL;
}

/* True if the iteration simulates less time in a cycle than the other one did recently. */
static bool is_slower(const kmp_collocation *s, kmp_iteration other)
{
    double better = other > s->iteration ? 1 / BETTER : BETTER;
    return s->simulated[s->iteration] * s->spent[other] < better * s->simulated[other] * s->spent[s->iteration];
}

/* About the cycles of a step by an iteration, with as many sweeps as the last one. A trial of Newton's method keeps one
 * Jacobian; those of each stage are not kept. */
static double step_cost(const kmp_collocation *s, kmp_iteration iteration)
{
    double sweep = kmp_collocation_sweep_cost(s), matrix = kmp_collocation_matrix_cost(s, iteration);
    double stages = KMP_STEP_CYCLES + s->sweeps * (sweep + kmp_collocation_correction_cost(s, iteration));
    double one = kmp_collocation_jacobian_cost(s), all = s->whole ? s->s * one : (1 + s->p + s->inner) * sweep;
    return stages + (iteration == KMP_ITERATION_PICARD   ? 0
                     : iteration == KMP_ITERATION_NEWTON ? (one + matrix) / TRIAL
                                                         : all + matrix);
}

/* True if the next iteration exists and steps may be so much longer by the error that it may be worth its cost. */
static bool is_worth(const kmp_collocation *s, double by_error, double by_iteration)
{
    kmp_iteration next = s->iteration + 1;
    if (next == KMP_ITERATIONS || (next == KMP_ITERATION_COUPLED && !s->all))
        return false;
    return by_error * step_cost(s, s->iteration) > WORTH * by_iteration * step_cost(s, next);
}

void kmp_collocation_choose(kmp_collocation *s, double h, double by_error, double by_iteration)
{
    /* Adds a step to the time simulated and the cycles spent of its iteration; those of steps before fade. */
    double *simulated = &s->simulated[s->iteration], *spent = &s->spent[s->iteration];
    s->base.cycles += KMP_STEP_CYCLES;
    double fades = h > GROWS * s->h_old ? 0 : FADES;
    *simulated = fades * *simulated + h;
    *spent = fades * *spent + s->base.cycles - s->cycles_before;
    s->cycles_before = s->base.cycles;
    s->far -= s->far > 0;
    if (s->mixing.on)
        by_iteration = fmin(by_iteration, length_of(s, h, s->unmixed));
    bool held = by_iteration < HELD * h && is_worth(s, by_error, by_iteration);
    s->limited = held ? s->limited + 1 : 0;
    s->free = s->iteration > s->method->cheapest && !s->whole && s->picard < EASY ? s->free + 1 : 0;
    if (s->trial_steps > 0 && --s->trial_steps == 0 && is_slower(s, s->before))
        end_trial(s);
    else if (s->trial_steps > 0)
        return;
    else if (s->free >= SEVERAL)
        kmp_collocation_begin_with(s, s->method->cheapest);
    else if (s->iteration < KMP_ITERATION_COUPLED && s->limited >= s->patience[s->iteration + 1])
        try_iteration(s, s->iteration + 1);
    else if (s->iteration == KMP_ITERATION_COUPLED && --s->trust <= 0)
        try_iteration(s, KMP_ITERATION_NEWTON);
}

bool kmp_collocation_is_near(const kmp_collocation *s, double size)
{
    const kmp_ode *ode = &s->base.ode;
    bool can = ode->improve && *ode->cycles_of_improve > 0 && s->iteration != KMP_ITERATION_COUPLED;
    return can && s->far == 0 && kmp_collocation_in_lanes(s) && size * s->widen * s->base.tolerance.rtol < NEAR;
}

void kmp_collocation_go_far(kmp_collocation *s)
{
    s->farther = s->farther == 0 ? TRUST : s->farther < MOST_PATIENCE ? 2 * s->farther : MOST_PATIENCE;
    s->far = s->farther;
}

bool kmp_collocation_keeps_jacobian(const kmp_collocation *s)
{
    double later = s->contraction * (2 * s->age + 3) / (2 * s->age + 1);
    if (!s->has_jacobian || s->iteration != KMP_ITERATION_NEWTON || !(later < 1))
        return false;
    double sweep = kmp_collocation_sweep_cost(s);
    double more = s->contraction > 0 ? s->sweeps * (log(s->contraction) / log(later) - 1) : 0;
    return more * (sweep + kmp_collocation_correction_cost(s, KMP_ITERATION_NEWTON)) <
           kmp_collocation_jacobian_cost(s) + kmp_collocation_matrix_cost(s, KMP_ITERATION_NEWTON);
}
