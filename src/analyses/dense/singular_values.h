/* SPDX-License-Identifier: BSD-3-Clause */
/* Singular values of dense column-major matrices, by LAPACK. */
#pragma once

#include "base/arena.h"

/** Singular values of a (n x n, lost), descending, and its right singular vectors as columns of v. 0; -1: no memory, or
 * the iteration did not converge. */
int kmp_singular_right(int n, double *a, double *values, double *v);

/** a (m x n) = u diag(s) vt, with k = min(m, n): u is m x k, vt is k x n, s descends. */
typedef struct kmp_singular {
    int m, n, k, lwork;
    double *u, *s, *vt;
    double *copy, *work;
} kmp_singular;

/** Allocates in an arena. false: no memory. */
bool kmp_singular_init(kmp_singular *svd, kmp_arena *arena, int m, int n);

/** Decomposes `a`, which is kept. false: the iteration did not converge (it does for finite entries). No allocation. */
bool kmp_singular_decompose(kmp_singular *svd, const double *a);
