/* SPDX-License-Identifier: BSD-3-Clause */
/* Sines and cosines of many arguments with the widest vectors of the machine. */
#ifndef KMP_BACKEND_SINCOS_H
#define KMP_BACKEND_SINCOS_H

/** s[i] = sin x[i], c[i] = cos x[i], the bits of kempe_sincos; the three arrays of n do not overlap. */
void kmp_sincos_many(int n, const double *x, double *s, double *c);

#endif
