/* SPDX-License-Identifier: BSD-3-Clause */
/* Eigenvalues of symmetric matrices, and least squares, of dense column-major matrices, by LAPACK. They allocate: not
 * for hot paths. */
#pragma once

#include "base/arena.h"

/** From this size on symmetric eigenproblems are solved by divide and conquer (Cuppen 1981), not by QL iterations,
 * which take several times as long there. Smaller ones keep their bits. */
enum { KMP_EIGEN_DIVIDED = 64 };

/** a (n x n, symmetric, its lower triangle is read) becomes its eigenvectors as columns; values ascend. Matrices of the
 * size above are solved group by group of unknowns that share no entry. 0; -1: no memory, or the iteration did not
 * converge (it does for finite entries). */
int kmp_symmetric_eigen(int n, double *a, double *values);

/** x (n) of least norm among the vectors that minimise |A x - b|; a is m x n, kept, its rank not known. Pivots below
 * rcond of the largest count as zero. Large ones are solved group by group of columns that share no row. Returns the
 * rank, -1 when there is no memory. */
int kmp_least_squares(int m, int n, const double *a, const double *b, double rcond, double *x);

/** The same for `count` right-hand sides (m each) and solutions (n each), one after the other. */
int kmp_least_squares_of(int m, int n, const double *a, int count, const double *b, double rcond, double *x);
