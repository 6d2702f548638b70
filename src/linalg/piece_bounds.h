/* SPDX-License-Identifier: BSD-3-Clause */
/* Bounds of a cubic between two places (Bernstein). Generated simulators have this file too. */
#pragma once

#include "constraints/tolerances.h"
#include <kempe/runtime.h>
#include <math.h>
#include <stdbool.h>

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

/** True if the second derivative of cubic pieces is continuous between two places: at the knots between them, of which
 * the first and the last one join straight lines. */
static inline bool kmp_bends_smoothly(int knots, const double *x, const double *piece, double from, double to)
{
    if (from < x[0] || to > x[knots - 1])
        return from > x[knots - 1] || to < x[0];
    for (int k = kempe_find_piece_(knots, x, from) + 1; k < knots - 1 && x[k] <= to; k++) {
        const double *left = piece + 4 * (k - 1), *right = piece + 4 * k;
        const double grown = 3 * left[3] * (x[k] - x[k - 1]), size = fabs(left[2]) + fabs(grown) + fabs(right[2]);
        if (fabs(left[2] + grown - right[2]) > KMP_BENDS_ALIKE * size)
            return false;
    }
    return true;
}
