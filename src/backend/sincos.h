/* SPDX-License-Identifier: BSD-3-Clause */
/* Sines and cosines of many arguments with the widest vectors of the machine. */
#ifndef KMP_BACKEND_SINCOS_H
#define KMP_BACKEND_SINCOS_H

#include <stdint.h>

/** s[i] = sin x[i], c[i] = cos x[i], the bits of kempe_sincos; the three arrays of n do not overlap. */
void kmp_sincos_many(int n, const double *x, double *s, double *c);

/** The same for eight lanes of each of n values in slots: those of slot x[k] at v + 8 x[k], to slots s[k] and c[k]. No
 * slot is both read and written. */
void kmp_sincos_slots(int n, double *v, const uint32_t *x, const uint32_t *s, const uint32_t *c);

#endif
