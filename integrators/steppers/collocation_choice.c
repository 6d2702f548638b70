/* SPDX-License-Identifier: BSD-3-Clause */
/* Which iteration the stages are found by, from step to step: by contraction, and by the time simulated in a counted
 * processor cycle. */
#include "integrators/steppers/collocation.h"

#include <math.h>

/* Contraction of Picard's iteration that the next step aims at. */
static const double CONTRACTS = 0.3;
/* The next iteration is tried when the error permits steps WORTH times as long as this one, and more where its
 * corrections cost more, SEVERAL times, which do not grow by HELD; Picard's returns when that contracts by EASY,
 * SEVERAL times. A trial has TRIAL steps. After one without success the next is twice as late. */
static const double WORTH = 1.4, EASY = 0.1, HELD = 1.2;
enum { SEVERAL = 3, TRIAL = 5, TRUST = 40, MOST_PATIENCE = 1000 };
/* Growth of the bound on steps after an iteration that failed; and where the iteration contracts by SURE. */
static const double RECOVERS = 1.1, RECOVERS_SURELY = 2, SURE = 0.01;
/* Cycles of an exact Jacobian over those of an evaluation, about. */
static const double EXACT = 3;

/* The program of all stages, and sums over the stages. */
double kmp_collocation_sweep_cost(const kmp_collocation *s)
{
    const kmp_ode *ode = &s->base.ode;
    double stages = ode->cycles_of_lanes > 0 ? ode->cycles_of_lanes : ode->cycles;
    return stages + KMP_SWEEP_CYCLES_OF_UNKNOWN * (s->p + s->inner);
}

double kmp_collocation_correction_cost(const kmp_collocation *s, kmp_iteration iteration)
{
    double n = s->inner, count = n * s->s;
    return iteration == KMP_ITERATION_PICARD   ? 0
           : iteration == KMP_ITERATION_NEWTON ? 8 * n * n + 8 * count
                                               : 2 * count * (n * s->w) / 8;
}

double kmp_collocation_matrix_cost(const kmp_collocation *s, kmp_iteration iteration)
{
    double n = s->inner, count = n * s->s;
    return iteration == KMP_ITERATION_PICARD   ? 0
           : iteration == KMP_ITERATION_NEWTON ? 8.0 / 3 * n * n * n
                                               : (2 * count + 4 * n) * count * (n * s->w) / 8;
}

double kmp_collocation_jacobian_cost(const kmp_collocation *s)
{
    double columns = ceil((s->p + s->inner) / (s->w - 1.0)), sweep = kmp_collocation_sweep_cost(s);
    return s->whole ? sweep + EXACT * s->base.ode.cycles : columns * sweep;
}

/* -- choice -------------------------------------------------------------------------------------------- */

double kmp_collocation_longest(kmp_collocation *s, double h)
{
    double fresh = s->iteration == KMP_ITERATION_NEWTON ? s->contraction / (2 * s->age + 1) : s->contraction;
    bool measured = s->iteration != KMP_ITERATION_COUPLED && fresh > 0;
    double most = measured ? h * fmax(0.5, sqrt(CONTRACTS / fresh)) : INFINITY;
    if (s->ceiling > 0) {
        most = fmin(most, s->ceiling);
        s->ceiling *= fresh < SURE ? RECOVERS_SURELY : RECOVERS;
    }
    return most;
}

static void change_iteration(kmp_collocation *s, kmp_iteration to)
{
    s->iteration = to;
    s->pace = 0;
    s->trial_steps = s->limited = s->free = 0;
    s->trust = TRUST;
    s->ceiling = 0;
    s->has_jacobian = s->fresh = s->factored = false;
}

void kmp_collocation_begin_with(kmp_collocation *s, kmp_iteration iteration)
{
    for (int k = 0; k < KMP_ITERATIONS; k++)
        s->patience[k] = SEVERAL;
    change_iteration(s, iteration);
}

/* Tries an iteration, and judges the trial after some steps. */
static void try_iteration(kmp_collocation *s, kmp_iteration to)
{
    s->before = s->iteration;
    s->pace_before = s->pace;
    change_iteration(s, to);
    s->trial_steps = TRIAL;
}

/* Returns to the iteration before, whose next trial is later. */
static void end_trial(kmp_collocation *s)
{
    double pace = s->pace_before;
    int *patience = &s->patience[s->iteration];
    *patience = *patience < MOST_PATIENCE ? 2 * *patience : MOST_PATIENCE;
    change_iteration(s, s->before);
    s->pace = pace;
    s->trust = *patience * TRUST / SEVERAL;
}

/* Time simulated in a cycle, recently. */
static void measure_pace(kmp_collocation *s, double h)
{
    s->base.cycles += KMP_STEP_CYCLES;
    double pace = h / (s->base.cycles - s->cycles_before);
    s->cycles_before = s->base.cycles;
    s->pace = s->pace > 0 ? 0.5 * (s->pace + pace) : pace;
}

/* True if the next iteration exists and steps may be so much longer by the error that it may be worth its cost. */
static bool is_worth(const kmp_collocation *s, double by_error, double by_iteration)
{
    kmp_iteration next = s->iteration + 1;
    if (next == KMP_ITERATIONS || (next == KMP_ITERATION_COUPLED && !s->all))
        return false;
    double sweep = kmp_collocation_sweep_cost(s), now = sweep + kmp_collocation_correction_cost(s, s->iteration);
    return by_error * now > WORTH * by_iteration * (sweep + kmp_collocation_correction_cost(s, next));
}

void kmp_collocation_choose(kmp_collocation *s, double h, double by_error, double by_iteration)
{
    measure_pace(s, h);
    bool held = by_iteration < HELD * h && is_worth(s, by_error, by_iteration);
    s->limited = held ? s->limited + 1 : 0;
    s->free = s->iteration > s->method->cheapest && !s->whole && s->picard < EASY ? s->free + 1 : 0;
    if (s->trial_steps > 0 && --s->trial_steps == 0 && s->pace < s->pace_before)
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
