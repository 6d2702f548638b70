/* SPDX-License-Identifier: BSD-3-Clause */
/* Times of samples, which are multiples of sample times; times that are equal up to rounding are one. Generated
 * simulators have this file too. */
#pragma once

#include "constraints/tolerances.h"
#include <math.h>
#include <stdbool.h>

/** The last time that is equal to t up to rounding: multiples of different sample times meet there. */
static inline double kmp_last_equal(double t)
{
    return t > 0 ? t * (1 + KMP_SAME_TIME) : t;
}

/** True if a sample at `sample` is due at t. */
static inline bool kmp_sample_is_due(double sample, double t)
{
    return sample <= kmp_last_equal(t);
}

/** The end of steps before a sample of states, the end of a piece of inputs and a stop. */
static inline double kmp_first_limit(double sample, double piece, double stop)
{
    double limit = fmin(sample, piece);
    if (fmax(sample, piece) <= kmp_last_equal(limit))
        limit = fmax(sample, piece);
    return stop <= kmp_last_equal(limit) ? stop : limit;
}

/** The number of the first sample at t or after. */
static inline double kmp_first_sample(double t, double period)
{
    double number = fmax(ceil(t / period) - 1, 0);
    while (kmp_last_equal(number * period) < t)
        number++;
    return number;
}
