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

/* False where long double is no wider than double, or where sinl is the instruction of x87, whose pi has 66 bits: the
 * sine of the double next to pi is known. */
static inline bool has_exact_sines(void)
{
    const volatile double pi = 3.14159265358979311600;
    return LDBL_MANT_DIG >= 64 && fabsl(1e16L * sinl((long double)pi) - 1.22464679914735317723L) < 1e-17L;
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
