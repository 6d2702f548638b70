/* SPDX-License-Identifier: BSD-3-Clause */
/* Adjoint method: the derivative of one scalar, at the end of a motion or integrated over it, by all parameters at
 * once, for any number of them. First the motion, stored as values of u and ud within each step; then backwards in time
 * the weights L of its state, with y' = f(y, p), y = (u, ud),
 *
 *     -dL/dt = f_y' L + g_y      L(t_end) = G_y      dG/dp = G_p + L(0)' dy_0/dp + integral of L' f_p + g_p
 *
 * (Cao, Li, Petzold and Serban, SIAM J. Scientific Computing 24 (2003) 1076, for index 1 and 0; here of the reduced
 * equations). f_y' L is kmp_linear_back: no matrix is made. Exchanges of u, and jumps at conditions that change
 * (forward.h), are passed backwards by their transposes. */
#pragma once

#include "studies/sensitivity/forward.h"

typedef struct kmp_adjoint_report {
    kmp_forward_report forward;
    long steps, rhs; /* backwards */
    size_t kept;     /* bytes of the motion */
    double value;
} kmp_adjoint_report;

/** The scalar is `target`, at ask->t_end or, `integral`, integrated from 0 to there; gradient: count values. Rows and
 * watch of `options` are ignored. Errors as kmp_forward_run. */
kempe_status kmp_adjoint_run(kmp_varied *varied, const kmp_forward *options, const kmp_forward_target *target,
                             bool integral, const double *sizes, double *gradient, kmp_adjoint_report *report);
