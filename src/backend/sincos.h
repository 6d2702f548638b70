/* SPDX-License-Identifier: BSD-3-Clause */
/* Sines and cosines of many arguments with the widest vectors of the machine. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

/** s[i] = sin x[i], c[i] = cos x[i], the bits of kempe_sincos; the three arrays of n do not overlap. */
void kmp_sincos_many(int n, const double *x, double *s, double *c);

/** Sines and cosines of v[angle[i]] in groups of eight: eight sines, eight cosines, the next eight sines. The bits
 * equal those of single calls. The list of n angles is padded to a multiple of eight with positions of any number, and
 * `out` has room for their results; it does not overlap the angles.
 */
void kmp_sincos_slots(uint32_t n, const uint32_t *angle, const double *v, double *out);

/** Sines and cosines of `width` lanes, at most 16, of n values in slots: values of slot x[k] at v + width x[k], results
 * in slots s[k] and c[k]. No slot is both read and written. The bits of a lane do not depend on the width. They are
 * those of kempe_sincos, or else `fused` ones within 1.5 ulp, in half the time; the fused sine of -0 is 0. */
void kmp_sincos_lanes(bool fused, int n, int width, double *v, const uint32_t *x, const uint32_t *s, const uint32_t *c);
