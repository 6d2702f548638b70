/* SPDX-License-Identifier: BSD-3-Clause */
/* Singular values of small dense matrices (LAPACK dgesvd), with workspace made once. */
#ifndef KMP_LINALG_DENSE_SINGULAR_H
#define KMP_LINALG_DENSE_SINGULAR_H

#include <stdbool.h>

/** a (m x n, column-major) = u diag(s) vt, with k = min(m, n): u is m x k, vt is k x n, s descends. */
typedef struct kmp_singular {
    int m, n, k, lwork;
    double *u, *s, *vt;
    double *copy, *work;
} kmp_singular;

/** false: no memory. */
bool kmp_singular_init(kmp_singular *svd, int m, int n);
void kmp_singular_free(kmp_singular *svd);

/** Decomposes `a`, which is kept. false: the iteration did not converge (it does for finite entries). No allocation. */
bool kmp_singular_decompose(kmp_singular *svd, const double *a);

#endif
