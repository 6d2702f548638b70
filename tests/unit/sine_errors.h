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

static const double odd_arguments[] = {0.0, -0.0, INFINITY, -INFINITY, NAN, 5e-324, 1e300, -1e5, 1e5, 1e5 + 1, M_PI_2};
enum { ODD_ARGUMENTS = sizeof odd_arguments / sizeof *odd_arguments };

/* Sines and cosines of n angles in `width` lanes, by the slots of angles, sines and cosines. */
typedef void lanes_of_sines(int n, int width, double *v, const uint32_t *x, const uint32_t *s, const uint32_t *c);

/* The numbers of each width that differ from those of one lane, also beside values beyond the limit. */
static inline int count_lanes_apart(lanes_of_sines *lanes, lanes_of_sines *one)
{
    static const uint32_t from[] = {1, 5}, to[] = {0, 3}, beside[] = {4, 2};
    int differ = 0;
    for (int trial = 0; trial < 200; trial++)
        for (int width = 1; width <= 16; width++) {
            double v[6 * 16], single[6];
            for (int k = 0; k < 6 * width; k++)
                v[k] = trial % 3 == 0 && uniform() < 0.3 ? odd_arguments[(int)(uniform() * ODD_ARGUMENTS)]
                                                         : 20 * (uniform() - 0.5);
            lanes(2, width, v, from, to, beside);
            for (int l = 0; l < width; l++) {
                for (int k = 0; k < 6; k++)
                    single[k] = v[k * width + l];
                one(2, 1, single, from, to, beside);
                for (int k = 0; k < 6; k++)
                    differ += !same(single[k], v[k * width + l]);
            }
        }
    return differ;
}

#endif
