/* SPDX-License-Identifier: BSD-3-Clause */
/* Small dense linear algebra, column-major, without allocation: for the hot path of a small mechanism. Larger or
 * general tasks use LAPACK (linalg/dense/lapack.h), KLU or UMFPACK (integrators/sundials/linear.def). */
#pragma once

#include "linalg/dense/factors.h"

/** Arithmetic of one call; comparisons, signs and moves are none. */
typedef struct kmp_flops {
    long add, mul, div, root;
} kmp_flops;

static inline void kmp_flops_add(kmp_flops *sum, long times, kmp_flops f)
{
    sum->add += times * f.add;
    sum->mul += times * f.mul;
    sum->div += times * f.div;
    sum->root += times * f.root;
}

/** a (n x n) <- L^-1 a L^-T, with the factor of kmp_cholesky_factor. */
void kmp_cholesky_congruence(int n, const double *l, double *a);

kmp_flops kmp_lu_flops(int n);
kmp_flops kmp_cholesky_factor_flops(int n);
kmp_flops kmp_cholesky_solve_flops(int n);

/** The r, c and pivots of kmp_lu_complete to the last bit where no column is fixed, in less time. `a` and `largest` (n)
 * are left as scratch. */
void kmp_pivots_complete(int m, int n, double *a, double *largest, int *r, int *c, double *pivots);
