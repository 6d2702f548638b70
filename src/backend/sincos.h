/* SPDX-License-Identifier: BSD-3-Clause */
/* Sines and cosines of many arguments with the widest vectors of the machine, with the bits of kempe_sincos. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

/** Sines and cosines of v[angle[i]] in groups of eight: eight sines, eight cosines, the next eight sines. The bits
 * equal the bits of single calls. The list of n angles is padded to a multiple of eight with positions of any number,
 * and `out` has room for their results; it does not overlap the angles.
 */
void kmp_sincos_slots(uint32_t n, const uint32_t *angle, const double *v, double *out);

/** Sines and cosines of `width` lanes, at most 16, of n values in slots: values of slot x[k] at v + width x[k], results
 * in slots s[k] and c[k]. No slot is both read and written. */
void kmp_sincos_lanes(int n, int width, double *v, const uint32_t *x, const uint32_t *s, const uint32_t *c);

/** The same where the value is not a number below KEMPE_SINCOS_LIMIT, by the functions of C; other results stay. The
 * bits of the limit: numbers |x| whose bits are larger, as integers, are beyond it or NaN. */
void kmp_sincos_beyond(int n, int width, double *v, const uint32_t *x, const uint32_t *s, const uint32_t *c);
#define KMP_SINCOS_LIMIT_BITS 0x40f86a0000000000
