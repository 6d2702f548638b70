/* SPDX-License-Identifier: BSD-3-Clause */
/* Minimum-norm least squares of matrices whose rank is not known: dense (LAPACK dgelsy: QR with column pivoting,
 * complete orthogonal factorisation), or sparse. Allocates: not for hot paths. */
#ifndef KMP_LINALG_LEAST_H
#define KMP_LINALG_LEAST_H

#include "linalg/sparse.h"

/** x (n) of least norm among those that minimise |A x - b|; a is m x n column-major, kept. Pivots below rcond of the
 * largest count as zero. Returns the rank, -1 when there is no memory. */
int kmp_least_squares(int m, int n, const double *a, const double *b, double rcond, double *x);

typedef enum kmp_least_outcome { KMP_LEAST_FOUND, KMP_LEAST_NONE, KMP_LEAST_NO_MEMORY } kmp_least_outcome;

/** The same where b is such that A x = b can be met but for redundant rows, and, damped, x of the least |A x - b|^2 +
 * |damping x|^2. Rows whose pivots in complete pivoting are below rcond of the largest are left out where the damping
 * is small. KMP_LEAST_NONE: the factorisation failed. */
kmp_least_outcome kmp_least_squares_sparse(const kmp_entries *a, const double *b, double damping, double rcond,
                                           double *x);

#endif
