/* SPDX-License-Identifier: BSD-3-Clause */
/* Products with J and M of the last evaluation. */
#pragma once

#include "constraints/evaluation/evaluator.h"

/** Copies J of the last closure with the rows in `left_out` (m) zero, into room for all entries of J. */
void kmp_eval_mask(const kmp_evaluator *eval, const bool *left_out, double *masked);

/** Dense copies of the last values, column-major: J is m x n, M n x n and symmetric. */
void kmp_eval_dense_jacobian(const kmp_evaluator *eval, double *jacobian);
void kmp_eval_dense_mass(const kmp_evaluator *eval, double *mass);

/** J qd + h_t (m values) at the last kmp_eval_closure. */
void kmp_eval_rates(const kmp_evaluator *eval, const double *qd, double *rates);

/** Power of moving closures at given multipliers, lambda' J qd = -lambda' h_t, with h_t of the last
 * kmp_eval_closure. */
double kmp_eval_drive_power(const kmp_evaluator *eval, const double *lambda);

/** out += M x. */
void kmp_eval_add_mass_times(const kmp_evaluator *eval, const double *x, double *out);

/** Kinetic energy qd' M qd / 2 of the last kmp_eval_mass. */
double kmp_eval_kinetic(const kmp_evaluator *eval, const double *qd);
