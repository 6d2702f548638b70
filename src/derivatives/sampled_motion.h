/* SPDX-License-Identifier: BSD-3-Clause */
/* Small motions of a model with sampled states, from one common sample to the next. */
#pragma once

#include "derivatives/linearized.h"

/** True for a state that is sampled, of an averaged system (derivatives/averaged.h) too. */
bool kmp_state_is_sampled(const kmp_state *state);

/** The map of x over the time in which all samples repeat, for inputs w that are constant during it:
 *
 *     x(k + 1) = phi x(k) + gamma w(k),
 *
 * where x(k) is the state before the samples. a (width x width) and b (width x inputs) are those of the averaged
 * system, x' = a x + b w; `every`: the time between samples of each entry of x, INFINITY of the others. phi and gamma
 * may be a and b. 0, with that time in *period; -1: no memory, or a number that is not finite; -2: the times have no
 * common multiple of a moderate size. */
int kmp_sampled_map(int width, int inputs, const double *a, const double *b, const double *every, double *period,
                    double *phi, double *gamma);

/** The eigenvalues of such a map for the last state of `linear`, whose matrices are made, in `re` and `im` (2 p);
 * *count: how many. Otherwise as kmp_sampled_map; -3: Mr is singular. */
int kmp_sampled_eigenvalues(const kmp_linear *linear, double *period, int *count, double *re, double *im);
