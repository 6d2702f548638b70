/* SPDX-License-Identifier: BSD-3-Clause */
/* Sines and cosines of many arguments with the widest vectors of the machine. */
#ifndef KMP_BACKEND_SINCOS_H
#define KMP_BACKEND_SINCOS_H

#include <stdint.h>

/** s[i] = sin x[i], c[i] = cos x[i], the bits of kempe_sincos; the three arrays of n do not overlap. */
void kmp_sincos_many(int n, const double *x, double *s, double *c);

/** Of v[angle[i]], by eights: eight sines, eight cosines, the next eight sines. The same bits. The list of n goes on,
 * to a multiple of eight, with places of any number, and `out` has room for their results; it lies apart from the
 * angles.
 */
void kmp_sincos_slots(uint32_t n, const uint32_t *angle, const double *v, double *out);

/** The same for eight lanes of each of n values in slots: those of slot x[k] at v + 8 x[k], to slots s[k] and c[k]. No
 * slot is both read and written. */
void kmp_sincos_lanes(int n, double *v, const uint32_t *x, const uint32_t *s, const uint32_t *c);

#endif
