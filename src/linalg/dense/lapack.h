/* SPDX-License-Identifier: BSD-3-Clause */
/* Eigenvalues, singular values and least squares of dense column-major matrices, by LAPACK. They allocate, but for
 * kmp_singular_decompose: not for hot paths. */
#pragma once

#include "base/arena.h"

/** Eigenvalues re + i im of a (n x n, lost), balanced first; conjugate pairs are adjacent, the positive imaginary part
 * first. Right and left vectors a v = s v, w^H a = s w^H are columns of their parts (n x n each), of norm 1. 0; -1: no
 * memory, or the iteration did not converge. */
int kmp_eigen_general(int n, double *a, double *re, double *im, double *v_re, double *v_im, double *w_re, double *w_im);

/** Eigenvalues of a complex a (n x n, lost) in `values` (n), in no order; real and imaginary part of each entry and
 * value are adjacent. 0; -1: no memory, or the iteration did not converge. */
int kmp_eigen_complex(int n, double *a, double *values);

/** a (n x n, symmetric, its lower triangle is read) becomes its eigenvectors as columns; values ascend. 0; -1: no
 * memory, or the iteration did not converge (it does for finite entries). */
int kmp_symmetric_eigen(int n, double *a, double *values);

/** k x = mu m x for symmetric k and positive m (n x n; lower triangles are read; both lost: k becomes the vectors, x' m
 * x = 1). Values ascend. 0; -1: no memory or no convergence; i + 1: minor i of m is not positive. */
int kmp_eigen_symmetric(int n, double *k, double *m, double *values);

/** x (n) of least norm among those that minimise |A x - b|; a is m x n, kept, its rank not known. Pivots below rcond of
 * the largest count as zero. Returns the rank, -1 when there is no memory. */
int kmp_least_squares(int m, int n, const double *a, const double *b, double rcond, double *x);

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
