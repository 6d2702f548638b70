/* SPDX-License-Identifier: BSD-3-Clause */
/* Sums over the stages of a step, with the stages in the lanes of vector registers: value k of lane l is at k width +
 * l. The same bits on every machine. */
#ifndef KMP_INTEGRATORS_STEPPERS_COLLOCATION_KERNELS_H
#define KMP_INTEGRATORS_STEPPERS_COLLOCATION_KERNELS_H

/* Numbers times lanes: a[k] a_lanes + b[k] b_lanes. */
typedef struct kmp_lane_terms {
    const double *a, *a_lanes, *b, *b_lanes;
} kmp_lane_terms;

/** out[k] = a[k] a_lanes + b[k] b_lanes + sum over the stages j of x[k][j] column[j], for k < count; width 4 or 8. */
void kmp_lanes_sum(int width, int count, int stages, const double *x, const double *column, const kmp_lane_terms *terms,
                   double *out);

/** out = f - x, in all lanes. */
void kmp_lanes_subtract(int width, int count, const double *f, const double *x, double *out);

/** x += change in all lanes; returns the sum over k < count and the stages of (weight[k] change[k])^2. */
double kmp_lanes_advance(int width, int count, int stages, const double *weight, const double *change, double *x);

#endif
