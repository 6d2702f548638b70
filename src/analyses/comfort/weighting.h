/* SPDX-License-Identifier: BSD-3-Clause */
/* Vibration as people feel it: weighted accelerations, their root mean squares, Sperling's ride index. Samples are
 * equally spaced. */
#pragma once

#include <stdbool.h>

typedef enum kmp_weighting {
#define KMP_WEIGHTING(word, ...) KMP_WEIGHTING_##word,
#include "analyses/comfort/weightings.def"
#undef KMP_WEIGHTING
    KMP_WEIGHTINGS
} kmp_weighting;

/** "Wb", .. */
const char *kmp_weighting_name(kmp_weighting weighting);

/** Weights samples of `rate` per second, beginning at rest: the exact response of the filter to the cubic polynomials
 * through four neighbouring samples. `out` may be `in`; at least four samples. false: no memory. */
bool kmp_weight(kmp_weighting weighting, double rate, int count, const double *in, double *out);

/** The root of the mean square over a number of steps, from one more sample, by the trapezoidal rule. */
double kmp_root_mean_square(int steps, const double *x);

/** Sperling's Wz of samples in m/s^2: (sum of (100 a B)^2)^(1/6.67), a being the root mean square at a frequency, over
 * Fourier's components from 0.5 to 30 Hz of sections of 10 s, of the whole where it is shorter; the sum is the mean of
 * the sections. */
double kmp_sperling(bool vertical, double rate, int count, const double *x);
