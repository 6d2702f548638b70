/* SPDX-License-Identifier: BSD-3-Clause */
/* Counted cycles of an evaluation: linear in its operations, with constants that were fitted once. Choices by cost
 * thereby depend only on the model and on whether machine code runs here, never on the speed of the machine or its
 * load. */
#include "integrators/formulations/cost_model.h"
#include "backend/encoders.h"
#include "constraints/evaluation/stage_lanes.h"
#include "integrators/steppers/collocation.h"
#include "integrators/steppers/solver.h"

#include <math.h>

/* Fitted to evaluations of the bench set (bench/bench_counted_time.c) on a processor of 3 GHz with registers of eight
 * doubles. Code of MORE operations in lanes does not remain in the first cache. Recursions over many bodies, which are
 * written out for articulated bodies, use values of long before. Registers of four doubles take 1.2 to 1.7 times as
 * long; they count as registers of eight, so that results are the same on both. */
static const double CALL = 130, EACH = 0.5, TRIG = 8, BY_PARTS = 300, EACH_BY_PARTS = 0.85;
static const double EACH_OF_BODIES = 0.55;
static const double CALL_LANES = 240, EACH_LANES = 0.55, EACH_MORE = 0.35, MORE = 3000, DIV_LANES = 40, TRIG_LANES = 30;
static const double BODIES = 1.8;

double kmp_cycles_of_one(kmp_counts count)
{
    return CALL + EACH * (double)count.paper + TRIG * (double)count.trig;
}

double kmp_cycles_of_lanes(kmp_counts count, bool by_bodies)
{
    double operations = (double)count.paper, each = EACH_LANES + EACH_MORE * fmin(1, operations / MORE);
    double cycles = CALL_LANES + (by_bodies ? BODIES : 1) * each * operations + DIV_LANES * (double)count.div +
                    TRIG_LANES * (double)count.trig;
    return kmp_code_form_of(4) ? cycles : KMP_STAGE_LANES * kmp_cycles_of_one(count);
}

/* Multipliers that forces depend on take four runs of stages in place of one, and two tests in each state. */
static const double FURTHER_CALLS = 3, TEST = 60;

double kmp_cycles_of_passes(void)
{
    return FURTHER_CALLS * CALL + 2 * TEST;
}

double kmp_cycles_of_passes_in_lanes(void)
{
    return FURTHER_CALLS * CALL_LANES + 2 * TEST * KMP_STAGE_LANES;
}

/* Measured by restarts on two-armed lamps (bench/lamps) and exchanges of small mechanisms. */
static const double MAKING = 2e5, MAKING_EACH = 1500;

double kmp_cycles_to_make(kmp_counts count)
{
    return MAKING + MAKING_EACH * (double)count.paper;
}

double kmp_cycles_by_parts(double operations, bool by_bodies)
{
    return BY_PARTS + (by_bodies ? EACH_OF_BODIES : EACH_BY_PARTS) * operations;
}

/* Means over motions of the bench set that are not stiff: stages of a step of dop853 and sweeps of one of radau, with
 * rejected ones. Dependent coordinates are integrated once, not twice, and their errors contract less in a sweep. */
static const double STAGES = 12.5, SWEEPS = 5.5, DEPENDENT = 2, MANY_DEPENDENT = 2;

static double cycles_of_stage(const kmp_ode *ode)
{
    return ode->cycles + KMP_CYCLES_OF_STAGE + KMP_CYCLES_OF_UNKNOWN * (ode->n - ode->quadratures);
}

double kmp_cycles_until_lanes_pay(const kmp_ode *ode, double ratio)
{
    const double several = 16,
                 least = 0.25; /* its errors are smaller, which is worth something where its time is not */
    return ratio < 1 ? ode->cycles_to_make / fmax(1 - ratio, least) : several * STAGES * cycles_of_stage(ode);
}

/* Steps of dop853 in a unit of the time of the motion, times a power of the tolerance; cycles of a run without its
 * steps, and further cycles where radau makes them in lanes. Fitted to measurements of 136 examples and models of tests
 * (bench/defaults --cold). */
static const double STEPS_OF_UNIT = 0.57, RUN = 1.2e5, RUN_IN_LANES = 0.45e5;

/* Rows that are dropped may take the place of others during a run, each time with programs that are made again. Fitted
 * to two-armed lamps. */
static const double CHANGING_ROWS = 1.15;

double kmp_steps_expected(double rtol, double length)
{
    return STEPS_OF_UNIT * length * pow(rtol, -1. / 8);
}

double kmp_cycles_ratio(const kmp_ode *ode, double rtol, double length)
{
    double n = ode->n - ode->quadratures, dependent = n - 2 * ode->positions;
    if (!(ode->cycles_of_lanes > 0))
        return INFINITY;
    double sweep = ode->cycles_of_lanes + KMP_SWEEP_CYCLES_OF_UNKNOWN * n;
    double one = cycles_of_stage(ode);
    double sweeps = SWEEPS + (dependent > 0 ? DEPENDENT : 0) + MANY_DEPENDENT * fmin(1, dependent / 20);
    /* Steps of dop853 over steps of radau at equal error, by the tolerance: the estimates are of orders 8 and 7, and
     * radau's is compared with another power of it (collocation.c). */
    double steps = fmax(1, 0.6 - 0.235 * log10(rtol));
    double run = RUN + kmp_steps_expected(rtol, length) * STAGES * one;
    double ratio = (sweeps * sweep + KMP_STEP_CYCLES + one) / (STAGES * one * steps) + RUN_IN_LANES / run;
    return ode->drops_rows ? CHANGING_ROWS * ratio : ratio;
}
