/* SPDX-License-Identifier: BSD-3-Clause */
/* The reduced equations of motion as they stand, for an integrator of F(t, y, y') = 0: no reduced mass is factored, and
 * in a residual none is formed. With y = (u, ud[, work]):
 *
 *     u' - ud = 0      X' (M qdd + C) = 0, qdd = X ud' + a0      work' - power = 0 */
#ifndef KMP_INTEGRATORS_REDUCED_RESIDUAL_H
#define KMP_INTEGRATORS_REDUCED_RESIDUAL_H

#include "integrators/dae.h"
#include "integrators/reduced_jacobian.h"

typedef struct kmp_reduced_residual {
    kmp_arena arena; /* of all arrays */
    int p, size;
    long *col_start, *row;
    double *differential, *factor; /* size: ones */
    double *jacobian;              /* size x size, of the residual by y */
} kmp_reduced_residual;

/** `power`: the state has the work of non-conservative forces as its last entry. false: no memory;
 * kmp_reduced_residual_free may follow. */
bool kmp_reduced_residual_init(kmp_reduced_residual *residual, int p, bool power);
void kmp_reduced_residual_free(kmp_reduced_residual *residual);

/** The pattern and what else stays. */
void kmp_reduced_residual_describe(const kmp_reduced_residual *residual, kmp_dae *dae);

/** values = dF/dy + cj dF/dy' at a state where the reduction has factors, tangent, M and C, and at (ud' = udd). */
void kmp_reduced_residual_matrix(kmp_reduced_residual *residual, kmp_reduced_jacobian *jacobian, double t, double cj,
                                 const double *q, const double *qd, const double *udd, double *values);

#endif
