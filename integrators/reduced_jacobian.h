/* SPDX-License-Identifier: BSD-3-Clause */
/* The exact Jacobian of the reduced right-hand side on closed states, by the implicit-function theorem. */
#ifndef KMP_INTEGRATORS_REDUCED_JACOBIAN_H
#define KMP_INTEGRATORS_REDUCED_JACOBIAN_H

#include "constraints/reduction.h"
#include "integrators/tangent.h"

typedef struct kmp_reduced_jacobian {
    kmp_tangents tangents;
    kmp_reduction *red;           /* not owned */
    double *qdd, *lambda;         /* n, m */
    double *dq, *dqd, *da, *zero; /* n */
    double *rows, *projected;     /* m, p */
} kmp_reduced_jacobian;

/** `power`: the state has the work of non-conservative forces as its last entry. */
kempe_status kmp_reduced_jacobian_init(kmp_reduced_jacobian *jacobian, kmp_reduction *red, bool power);
void kmp_reduced_jacobian_free(kmp_reduced_jacobian *jacobian);

/** j = d(ud, udd[, power]) / d(u, ud[, work]), column-major of leading dimension `size`, zeroed before, at a state
 * where the reduction has factors, tangent and the accelerations udd. The power of moving closures, and what
 * multipliers change of the power of forces, is left out of the last row. No allocation. */
void kmp_reduced_jacobian_eval(kmp_reduced_jacobian *jacobian, double t, const double *q, const double *qd,
                               const double *udd, int size, double *j);

/** j = dF/d(u, ud[, work]) + cj dF/d(u', ud'[, work']), likewise, of F = (u' - ud, X' (M qdd + C)[, work' - power]) at
 * ud' = udd, where the reduction has factors, tangent and a0, the plant M and C. */
void kmp_reduced_jacobian_of_residual(kmp_reduced_jacobian *jacobian, double t, double cj, const double *q,
                                      const double *qd, const double *udd, int size, double *j);

#endif
