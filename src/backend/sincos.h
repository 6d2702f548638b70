/* SPDX-License-Identifier: BSD-3-Clause */
/* Sines and cosines of many arguments with the widest vectors of the machine. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

/** Sines and cosines of v[angle[i]] in groups of eight: eight sines, eight cosines, the next eight sines. The bits
 * equal those of single calls. The list of n angles is padded to a multiple of eight with positions of any number, and
 * `out` has room for their results; it does not overlap the angles.
 */
void kmp_sincos_slots(uint32_t n, const uint32_t *angle, const double *v, double *out);

/** The same by rotation from angles nearby, in 0.6 of the time of fused ones: `base` has for each of the n values
 * `width` angles, their fused sines and their cosines, as kmp_sincos_keep takes them. Lanes whose differences have a
 * norm above KMP_SINCOS_NEAR have fused results. Errors are below 3 units of 2^-53. */
#define KMP_SINCOS_NEAR 0.375
