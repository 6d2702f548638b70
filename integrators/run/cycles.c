/* SPDX-License-Identifier: BSD-3-Clause */
#include "integrators/run/cycles.h"
#include "backend/lanes.h"
#include "backend/x86/x86.h"
#include "integrators/steppers/collocation.h"
#include "integrators/steppers/solver.h"

#include <math.h>

/* Fitted to the programs of the bench set (docs/decisions/collocation.md), in cycles of a processor with registers of
 * eight doubles. Code of many operations in lanes does not remain in the first cache: MORE operations double their
 * cost. Registers of four doubles run the program in two halves. */
static const double CALL = 130, EACH = 0.58, TRIG = 8;
static const double CALL_PARTS = 300, EACH_PARTS = 0.85;
static const double CALL_LANES = 240, EACH_LANES = 0.7, EACH_MORE = 0.8, MORE = 3000, TRIG_LANES = 30, HALVES = 1.7;

double kmp_cycles_of_one(kmp_counts count)
{
    return CALL + EACH * (double)count.paper + TRIG * (double)count.trig;
}

double kmp_cycles_by_parts(double operations)
{
    return CALL_PARTS + EACH_PARTS * operations;
}

double kmp_cycles_of_lanes(kmp_counts count)
{
    double operations = (double)count.paper, each = EACH_LANES + EACH_MORE * fmin(1, operations / MORE);
    double cycles = CALL_LANES + each * operations + TRIG_LANES * (double)count.trig;
    return kmp_x86_runs(KMP_X86_EIGHT)  ? cycles
           : kmp_x86_runs(KMP_X86_FOUR) ? HALVES * cycles
                                        : KMP_LANES_MOST * kmp_cycles_of_one(count);
}

/* Sweeps of a step of radau, stages of a step of dop853, rejected ones included: means over the bench set. */
static const double SWEEPS = 7.7, STAGES = 12.5;

/* Steps of dop853 over those of radau at equal error, by the digits of the tolerance: orders of the estimates, and
 * means over the bench set. */
static double steps_ratio(double rtol)
{
    return fmax(1, 0.45 - 0.175 * log10(rtol));
}

double kmp_cycles_ratio(const kmp_ode *ode, double rtol)
{
    double n = ode->n - ode->quadratures, inner = n - ode->positions;
    if (!(ode->cycles_of_lanes > 0))
        return INFINITY;
    double sweep = ode->cycles_of_lanes + KMP_SWEEP_CYCLES_OF_UNKNOWN * (ode->positions + inner);
    double one = ode->cycles + KMP_CYCLES_OF_STAGE + KMP_CYCLES_OF_UNKNOWN * n;
    return (SWEEPS * sweep + KMP_STEP_CYCLES + one) / (STAGES * one * steps_ratio(rtol));
}
