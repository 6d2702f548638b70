/* SPDX-License-Identifier: BSD-3-Clause */
/* SUNDIALS KINSOL: Newton's method with a line search for small dense systems f(x) = 0. */
#pragma once

#include <stdbool.h>

/* scale_x and scale_f make unknowns and equations of comparable size 1. f: r (n); jac: a = df/dx (n x n,
 * column-major, zeroed before the call). Both return 0, a positive value to request a shorter step, or a negative
 * one to abort. */
typedef struct kmp_kinsol_problem {
    void *self;
    int n;
    const double *scale_x, *scale_f;
    int (*f)(void *self, const double *x, double *r);
    int (*jac)(void *self, const double *x, double *a);
} kmp_kinsol_problem;

/** Solves from x until max |scale_f f| < ftol. false: not converged, x is unchanged. */
bool kmp_kinsol_solve(const kmp_kinsol_problem *problem, double ftol, double *x, int *iterations);
