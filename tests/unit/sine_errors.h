/* SPDX-License-Identifier: BSD-3-Clause */
/* Errors of sines and cosines in units of the last place, and arguments by chance. */
#ifndef KEMPE_TESTS_SINE_ERRORS_H
#define KEMPE_TESTS_SINE_ERRORS_H

#include "testing.h"
#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

static uint64_t seed = 1;

/* Knuth's MMIX generator; uniform in [0, 1). */
static inline double uniform(void)
{
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return (double)(seed >> 11) * 0x1p-53;
}

static inline int same(double a, double b)
{
    return memcmp(&a, &b, sizeof a) == 0 || (isnan(a) && isnan(b));
}

/* pi/2 beyond long double: libm's argument is reduced exactly, so sinl of a double is right to 64 bits. */
static inline double ulps(double value, long double exact)
{
    int e;
    (void)frexp((double)exact, &e);
    double ulp = ldexp(1.0, e - DBL_MANT_DIG < -1074 ? -1074 : e - DBL_MANT_DIG);
    return (double)(fabsl((long double)value - exact) / (long double)ulp);
}

#endif
