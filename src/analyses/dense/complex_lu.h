/* SPDX-License-Identifier: BSD-3-Clause */
/* Complex dense equations, column-major, without allocation. */
#pragma once

/** C11's CMPLX, which clang has not with every C library. */
#define KMP_COMPLEX(re, im) __builtin_complex((double)(re), (double)(im))

/** |re| + |im|, which costs no root. */
static inline double kmp_complex_size(double _Complex x)
{
    return __builtin_fabs(__builtin_creal(x)) + __builtin_fabs(__builtin_cimag(x));
}

/** LU of a complex matrix, whose pivots are kept as reciprocals, and the solution for one right-hand side. */
int kmp_lu_complex_factor(int n, double _Complex *a, int *pivot);
void kmp_lu_complex_solve(int n, const double _Complex *a, const int *pivot, double _Complex *b);
