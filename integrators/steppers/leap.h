/* SPDX-License-Identifier: BSD-3-Clause */
/* The integrator of the zone: over a singular place of the right-hand side in one step where the solution goes straight
 * on, by DOP853 where it does not. It wants `closed` and `positions` of the ODE, and is never asked for by name. */
#ifndef KMP_INTEGRATORS_STEPPERS_LEAP_H
#define KMP_INTEGRATORS_STEPPERS_LEAP_H

#include "integrators/steppers/solver.h"

extern const kmp_solver_kind kmp_solver_leap;

/** The least distance from the singular place on the way of all leaps since the start, and when it was; false when
 * there was no leap. */
void kmp_leap_nearest(const void *solver, double *time, double *size);

#endif
