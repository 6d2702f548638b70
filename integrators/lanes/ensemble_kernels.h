/* SPDX-License-Identifier: BSD-3-Clause */
/* The arithmetic of DOP853 on vectors of lanes, in the order of operations of dop853.c. */
#ifndef KMP_INTEGRATORS_LANES_ENSEMBLE_KERNELS_H
#define KMP_INTEGRATORS_LANES_ENSEMBLE_KERNELS_H

#include <stddef.h>

/** out = y + h sum a[j] k[j] for vectors of `size` components; h has one value per lane. */
void kmp_lanes_combine(size_t width, size_t size, const double *y, const double *h, int terms, const double *a,
                       const double *const *k, double *out);

/** Inputs and outputs of an error estimate. */
typedef struct kmp_lanes_step {
    const double *y, *h, *atol;
    double *const *k; /* k[1] .. k[12] */
    double rtol;
    double *y_new, *weight, *error; /* error: one per lane */
} kmp_lanes_step;

/** Computes the solution of order 8, the error weights, and the error of each lane: 1 is at the tolerance. */
void kmp_lanes_solution(size_t width, size_t size, const kmp_lanes_step *step);

/** Measurements at the end of a step, by lanes. */
typedef struct kmp_lanes_end {
    int p, r;
    const int *u, *v;         /* of the choice of u */
    const double *h, *dv, *b; /* r; r; r x p, column-major */
    const double *weight;     /* r: of the dependent coordinates */
    const double *scale, *row_scale;
    double *residual;   /* max |h|, scaled */
    double *correction; /* max |dv| in weights */
    double *growth;     /* max |Bvu|, scaled */
} kmp_lanes_end;

void kmp_lanes_measure(size_t width, const kmp_lanes_end *end);

/** to = from in the lanes where `which` is not 0. */
void kmp_lanes_take(size_t width, size_t size, const double *which, const double *from, double *to);

#endif
