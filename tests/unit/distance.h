/* SPDX-License-Identifier: BSD-3-Clause */
#ifndef KEMPE_TESTS_DISTANCE_H
#define KEMPE_TESTS_DISTANCE_H

#include <math.h>

/** |a - b| in units of the largest of b, at least 1; infinite where a is no number. */
static inline double distance(int n, const double *a, const double *b)
{
    double off = 0, size = 1;
    for (int k = 0; k < n; k++) {
        off = fmax(off, isfinite(a[k]) ? fabs(a[k] - b[k]) : INFINITY);
        size = fmax(size, fabs(b[k]));
    }
    return off / size;
}

#endif
