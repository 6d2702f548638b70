/* SPDX-License-Identifier: BSD-3-Clause */
/* Products of two vectors and other loops over vectors, in line. */
#pragma once

#include "linalg/dense/three.h"
#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stddef.h>

static inline double kmp_dot(int n, const double *a, const double *b)
{
    double s = 0;
    for (int i = 0; i < n; i++)
        s += a[i] * b[i];
    return s;
}

/* to = from; NULL is zero. */
static inline void kmp_copy_or_zero(int n, const double *from, double *to)
{
    for (int i = 0; i < n; i++)
        to[i] = from ? from[i] : 0;
}

/* to = from, where it is wanted: not NULL. */
static inline void kmp_copy_wanted(int n, const double *from, double *to)
{
    for (int i = 0; to && i < n; i++)
        to[i] = from[i];
}

/* Row k of rows of n numbers; NULL of none. */
static inline double *kmp_row_at(const double *rows, int n, int k)
{
    return rows ? (double *)rows + (ptrdiff_t)n * k : NULL;
}

static inline bool kmp_all_finite(int n, const double *x)
{
    int bad = 0; /* no branch, so that the loop vectorises */
    for (int i = 0; i < n; i++)
        bad |= !(fabs(x[i]) <= DBL_MAX);
    return !bad;
}
