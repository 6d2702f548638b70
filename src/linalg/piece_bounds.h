/* SPDX-License-Identifier: BSD-3-Clause */
/* Bounds of a cubic between two places (Bernstein). Generated simulators have this file too. */
#pragma once

#include <kempe/runtime.h>
#include <math.h>

static inline void kmp_include(double x, double *low, double *high)
{
    *low = fmin(*low, x);
    *high = fmax(*high, x);
}

/** Widens bounds by the control values of a piece's derivative between two places, within which it stays. */
static inline void kmp_piece_bounds(const double piece[4], int derivative, double from, double to, double *low,
                                    double *high)
{
    double w = to - from, power = 1, d[4]; /* power: w^k / k! */
    for (int k = 0; k < 4; power *= w / ++k)
        d[k] = kempe_piece_(piece, derivative + k, from) * power;
    kmp_include(d[0], low, high);
    kmp_include(d[0] + d[1] / 3, low, high);
    kmp_include(d[0] + (2 * d[1] + d[2]) / 3, low, high);
    kmp_include(d[0] + d[1] + d[2] + d[3], low, high);
}
