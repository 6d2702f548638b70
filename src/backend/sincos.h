/* SPDX-License-Identifier: BSD-3-Clause */
/* Sines and cosines of many arguments with the widest vectors of the machine: with the bits of kempe_sincos,
 * by fused multiply-adds, with half the operations, or by rotation from angles nearby, with fewer still. */
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

/** Sines and cosines of `width` lanes, at most 16, of n values in slots: values of slot x[k] at v + width x[k], results
 * in slots s[k] and c[k]. No slot is both read and written. The bits of a lane do not depend on the width. They are
 * those of kempe_sincos, or else `fused` ones within 1.5 ulp, in half the time; the fused sine of -0 is 0. */
void kmp_sincos_lanes(bool fused, int n, int width, double *v, const uint32_t *x, const uint32_t *s, const uint32_t *c);
void kmp_sincos_near(int n, int width, double *v, const uint32_t *x, const uint32_t *s, const uint32_t *c,
                     const double *base);

/** Takes angles with their sines and cosines into a base, in the lanes that are not 0. */
void kmp_sincos_keep(int n, int width, double *v, const uint32_t *x, const uint32_t *s, const uint32_t *c,
                     const int64_t *lanes, double *base);
