/* SPDX-License-Identifier: BSD-3-Clause */
/* Simplified Newton's method for the stages, with one Jacobian f_q, f_v for all of them. */
#pragma once

#include "integrators/steppers/collocation.h"

/** Evaluates the Jacobian where the middle stage is predicted (s->stage, s->at), if there is none to be kept, and
 * factors the matrices of a step h. s->at, s->stage, s->f and s->change are lost. KMP_COLLOCATION_BAD_ITERATION: they
 * are singular. */
kmp_collocation_outcome kmp_collocation_prepare_newton(kmp_collocation *s, double h);

/** Turns residuals (inner x w) into Newton's corrections. */
void kmp_collocation_correct_newton(kmp_collocation *s, double *change);

/** Removes the stiff part of the estimate in `error`, of the motion and of this number of columns that follow it. */
void kmp_collocation_filter(kmp_collocation *s, int columns);

/** Takes a correction s->change of g in a sweep, and combines it with those before where they fall slowly. Returns the
 * larger weighted square of the correction and of the combination. */
double kmp_collocation_mix(kmp_collocation *s, bool first);

/** The weighted square of x (inner x w). */
double kmp_collocation_square(const kmp_collocation *s, const double *x);

/* Newton's method for the stages with a Jacobian of each, in one system of all stages. */

bool kmp_collocation_allocate_coupled(kmp_collocation *s);
kmp_collocation_outcome kmp_collocation_prepare_coupled(kmp_collocation *s, double h);
void kmp_collocation_correct_coupled(kmp_collocation *s, double *change);

/** Inverts the system of all stages with the Jacobians `of` them, inner x (p + inner), column-major, in lanes. false:
 * it is singular. */
bool kmp_collocation_couple(kmp_collocation *s, const double *of);
