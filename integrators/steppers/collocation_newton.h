/* SPDX-License-Identifier: BSD-3-Clause */
/* Simplified Newton's method for the stages, with one Jacobian f_q, f_v for all of them. */
#pragma once

#include "integrators/steppers/collocation.h"

/** Evaluates the Jacobian where the middle stage is predicted (s->stage, s->at), if there is none to be kept, and
 * factors the matrices of a step h. s->at, s->stage, s->f and s->change are lost. KMP_COLLOCATION_BAD_ITERATION: they
 * are singular. */
kmp_collocation_outcome kmp_collocation_prepare_newton(kmp_collocation *s, double h);

/** Factors the matrices of a step h with s->jacobian, if that has not been done. false: they are singular. */
bool kmp_collocation_factor(kmp_collocation *s, double h);

/** Turns the residuals in `change` into Newton's corrections. */
void kmp_collocation_correct_newton(kmp_collocation *s);

/** Removes the stiff part of the estimate in `error`. */
void kmp_collocation_filter(kmp_collocation *s);

/** The exact Jacobian at (t, y), without positions and quadratures. */
int kmp_collocation_take_exact(kmp_collocation *s, double t, const double *y, double *jacobian);

/** Changes unknown k, *x, for a difference; returns by how much. */
double kmp_collocation_displace(const kmp_collocation *s, int k, double *x);

/** Copies the predicted stage i; returns its time. */
double kmp_collocation_copy_stage(const kmp_collocation *s, int i, double *y);
