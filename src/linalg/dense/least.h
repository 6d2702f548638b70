/* SPDX-License-Identifier: BSD-3-Clause */
/* Minimum-norm least squares of dense matrices whose rank is not known (LAPACK dgelsy: QR with column pivoting,
 * complete orthogonal factorisation). Allocates: not for hot paths. */
#ifndef KMP_LINALG_DENSE_LEAST_H
#define KMP_LINALG_DENSE_LEAST_H

/** x (n) of least norm among those that minimise |A x - b|; a is m x n column-major, kept. Pivots below rcond of the
 * largest count as zero. Returns the rank, -1 when there is no memory. */
int kmp_least_squares(int m, int n, const double *a, const double *b, double rcond, double *x);

#endif
