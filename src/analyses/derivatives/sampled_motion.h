/* SPDX-License-Identifier: BSD-3-Clause */
/* Small motions of a model with sampled states, from one common sample to the next. */
#pragma once

#include "analyses/derivatives/linearized.h"
#include "model/data/force.h"
#include "model/data/state.h"

/** True for a state that is sampled, of an averaged system (analyses/derivatives/averaged.h) too. */
bool kmp_state_is_sampled(const kmp_state *state);

/** True where some state is. */
bool kmp_samples_in(const kempe_model *model);

/** The map of x over the time in which all samples repeat, for inputs w that are constant during it:
 *
 *     x(k + 1) = phi x(k) + gamma w(k),
 *
 * where x(k) is the state before the samples. a (width x width) and b (width x inputs) belong to the averaged
 * system, x' = a x + b w; `every`: the time between samples of each entry of x, INFINITY of the others. phi and gamma
 * may be a and b. 0, with that time in *period; -1: no memory, or a number that is not finite; -2: the times have no
 * common multiple of a moderate size. */
int kmp_sampled_map(int width, int inputs, const double *a, const double *b, const double *every, double *period,
                    double *phi, double *gamma);

/** The sentence of a failure of kmp_sampled_map; -3: Mr is singular. KEMPE_E_FAILED. */
kempe_status kmp_sampled_complain(kempe_context *context, int failed);

/** Eigenvalues z of such a map, and their right eigenvectors. */
typedef struct kmp_sampled_spectrum {
    kmp_arena arena; /* of all arrays */
    double period;
    int count;
    int *place;          /* count: where an entry of x is among the independent coordinates and their rates (2 p) */
    double *re, *im;     /* count: pairs are adjacent, the positive imaginary part first */
    double *x_re, *x_im; /* count x count */
} kmp_sampled_spectrum;

/** Computes the spectrum at the last state of `linear`, whose matrices are made. KEMPE_E_MEMORY; KEMPE_E_FAILED, with a
 * sentence: the sample times have no common multiple, Mr is singular, or a number is not finite. To be freed in any
 * case. */
kempe_status kmp_sampled_spectrum_init(kmp_sampled_spectrum *spectrum, const kmp_linear *linear);
void kmp_sampled_spectrum_free(kmp_sampled_spectrum *spectrum);

/** s = ln(z)/T of eigenvalue k, the continuous motion with the same values at the samples, -pi < T im(s) <= pi. A z
 * within KMP_SAMPLED_OVER of zero counts as that number. */
void kmp_sampled_rate(const kmp_sampled_spectrum *spectrum, int k, double *re, double *im);
