/* SPDX-License-Identifier: BSD-3-Clause */
/* Counted time: about the processor cycles of work by its operations, with no clock, so that choices by it are the same
 * in each run. */
#pragma once

#include "integrators/steppers/ode.h"
#include "symbolic/program.h"

/** A run of a program with this number of operations, for one instance, and for eight in vector lanes; `by_bodies`: of
 * articulated bodies. */
double kmp_cycles_of_one(kmp_counts count);
double kmp_cycles_of_lanes(kmp_counts count, bool by_bodies);

/** Cycles of the solution for multipliers that forces depend on, in addition to its operations. */
double kmp_cycles_of_passes(void);
double kmp_cycles_of_passes_in_lanes(void);

/** Writing such a program, with its machine code, for one instance and in lanes. */
double kmp_cycles_to_make(kmp_counts count);

/** An evaluation by a program and loops of linear algebra of these numbers of operations. */
double kmp_cycles_by_parts(double operations, bool by_bodies);

/** The counted time of radau over the time of dop853 for the same motion, not stiff, of n unknowns, at a tolerance;
 * infinite where stages have no lanes. `length`: of the motion in units of its time, the reciprocal of its rate scale;
 * infinite for a long one. */
double kmp_cycles_ratio(const kmp_ode *ode, double rtol, double length);

/** Steps of dop853 for a motion that is not stiff, of such a length. */
double kmp_steps_expected(double rtol, double length);

/** Counted cycles of dop853 in which radau in lanes, with this ratio, saves what it takes to make the lanes; some steps
 * where the ratio promises nothing, because a trial has found what it does not count. */
double kmp_cycles_until_lanes_pay(const kmp_ode *ode, double ratio);

/** Below this ratio radau is taken, because its errors are smaller. On the bench set the expected ratio is too large by
 * half on many models, too small by a quarter on chains of loops and trees. */
#define KMP_RATIO_WORTH 1.05
