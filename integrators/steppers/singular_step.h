/* SPDX-License-Identifier: BSD-3-Clause */
/* The integrator across change points: one step across a singular place of the right-hand side if the solution
 * continues straight, steps of DOP853 if it does not. It requires `closed` and `positions` of the ODE, and cannot be
 * chosen by name. */
#pragma once

#include "integrators/steppers/solver.h"

extern const kmp_solver_kind kmp_solver_singular_step;

/** The least distance from the singular place along all steps across since the start, and its time; false without such
 * a step. */
void kmp_singular_step_nearest(const void *solver, double *time, double *size);
