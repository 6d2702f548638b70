/* SPDX-License-Identifier: BSD-3-Clause */
/* LU with partial pivoting. Pivots are chosen by the sum of absolute values; each is kept as its reciprocal. Loops run
 * down columns, as compilers vectorise them. */
#include "analyses/dense/complex_lu.h"
#include <complex.h>
#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stddef.h>

/* The compiler's own product looks at infinities one by one. */
static inline double complex times(double complex x, double complex y)
{
    return KMP_COMPLEX(creal(x) * creal(y) - cimag(x) * cimag(y), creal(x) * cimag(y) + cimag(x) * creal(y));
}

/* 1 / x in place, without overflow or underflow. False: zero or not finite. */
static bool invert(double complex *x)
{
    double scale = fmax(fabs(creal(*x)), fabs(cimag(*x)));
    if (!(scale > 0.0 && kmp_complex_size(*x) <= DBL_MAX))
        return false;
    double re = creal(*x) / scale, im = cimag(*x) / scale, square = re * re + im * im;
    *x = KMP_COMPLEX(re / square / scale, -im / square / scale);
    return true;
}

/* column -= l times its entry k, below row k */
static void eliminate_complex(int n, int k, const double complex *l, double complex *restrict column)
{
    for (int i = k + 1; i < n; i++)
        column[i] -= times(l[i], column[k]);
}

static void exchange_complex(double complex *a, double complex *b)
{
    double complex t = *a;
    *a = *b;
    *b = t;
}

int kmp_lu_complex_factor(int n, double complex *a, int *pivot)
{
    for (int k = 0; k < n; k++) {
        double complex *l = a + (ptrdiff_t)k * n;
        int p = k;
        for (int i = k + 1; i < n; i++)
            p = kmp_complex_size(l[i]) > kmp_complex_size(l[p]) ? i : p;
        pivot[k] = p;
        for (int j = 0; j < n && p != k; j++)
            exchange_complex(&a[k + (ptrdiff_t)j * n], &a[p + (ptrdiff_t)j * n]);
        if (!invert(&l[k]))
            return k + 1;
        for (int i = k + 1; i < n; i++)
            l[i] = times(l[i], l[k]);
        for (int j = k + 1; j < n; j++)
            eliminate_complex(n, k, l, a + (ptrdiff_t)j * n);
    }
    return 0;
}

void kmp_lu_complex_solve(int n, const double complex *a, const int *pivot, double complex *b)
{
    for (int k = 0; k < n; k++)
        if (pivot[k] != k)
            exchange_complex(&b[k], &b[pivot[k]]);
    for (int k = 0; k < n; k++)
        eliminate_complex(n, k, a + (ptrdiff_t)k * n, b);
    for (int k = n - 1; k >= 0; k--) {
        const double complex *u = a + (ptrdiff_t)k * n;
        b[k] = times(b[k], u[k]);
        for (int i = 0; i < k; i++)
            b[i] -= times(u[i], b[k]);
    }
}
