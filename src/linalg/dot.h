/* SPDX-License-Identifier: BSD-3-Clause */
/* Products of two vectors and other loops over vectors, in line. */
#pragma once

#include <float.h>
#include <math.h>
#include <stdbool.h>

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

static inline bool kmp_all_finite(int n, const double *x)
{
    int bad = 0; /* no branch, so that the loop vectorises */
    for (int i = 0; i < n; i++)
        bad |= !(fabs(x[i]) <= DBL_MAX);
    return !bad;
}

static inline double kmp_dot3(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void kmp_cross3(const double a[3], const double b[3], double c[3])
{
    for (int i = 0; i < 3; i++)
        c[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}
