/* SPDX-License-Identifier: BSD-3-Clause */
/* SUNDIALS KINSOL: Newton's method with a line search for small dense systems f(x) = 0, from far away. */
#ifndef KMP_CONSTRAINTS_KINSOL_H
#define KMP_CONSTRAINTS_KINSOL_H

#include "base/context.h"

/** Solves f(x) = 0 from x until max |scale_f f| < ftol. scale_x and scale_f make unknowns and residuals of
 *  comparable size 1. r = f(x) and a = df/dx (n x n, column-major, zeroed before the call); both return KMP_GO,
 *  KMP_RETRY (try closer) or KMP_HALT. x is untouched on failure; `iterations` (may be NULL) is set always. */
kempe_status kmp_kinsol_solve(kempe_context *context, int n, double *x, const double *scale_x, const double *scale_f,
                              int (*f)(void *self, const double *x, double *r),
                              int (*jac)(void *self, const double *x, double *a), void *self, double ftol,
                              int *iterations);

#endif
