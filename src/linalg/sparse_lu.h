/* SPDX-License-Identifier: BSD-3-Clause */
/* Factors of a large diagonal block of block.h, by its non-zeros. Columns are in an order of little fill; rows are
 * pivoted by KLU, and later values are factored with the same pivots, without allocation, until these no longer suit.
 * Right-hand sides are in the order of pivots, solutions in the order of columns. */
#pragma once

#include <stdint.h>

typedef struct kmp_sparse_lu kmp_sparse_lu;

/** n x n with nz entries (row[k], col[k]), none twice, and none of the diagonal missing. order (n): the columns in the
 * order of elimination. NULL: no memory, or dense factors cost less (kmp_memory_failures distinguishes them). */
kmp_sparse_lu *kmp_sparse_lu_new(int n, int nz, const int *row, const int *col, int *order);
void kmp_sparse_lu_free(kmp_sparse_lu *s);

/** Factors new values of the same entries in the same order: the row in each pivoted position, reciprocal pivots, and
 * the sign of the determinant, up to one that the pattern fixes. Returns 0, or 1 + the position of a pivot that has no
 * reciprocal. */
int kmp_sparse_lu_factor(kmp_sparse_lu *s, const double *values, int *pivoted, double *inverse, int *sign);

/** w <- U^-1 L^-1 w, of `lanes` right-hand sides, value i of lane l at i lanes + l; w <- (L U)^-T w of one. */
void kmp_sparse_lu_solve(const kmp_sparse_lu *s, const double *inverse, int lanes, double *w);
void kmp_sparse_lu_solve_transposed(const kmp_sparse_lu *s, const double *inverse, double *w);

/** As kmp_sparse_lu_solve at the columns [from, end) of x, multiples of four, whose row i is at column[i] stride. */
void kmp_sparse_lu_solve_rows(const kmp_sparse_lu *s, const double *inverse, const int *column, int stride, int from,
                              int end, double *x);

/** The number of its entries. */
int kmp_sparse_lu_entries(const kmp_sparse_lu *s);

/** Products of a factorisation, and of a solution. */
int64_t kmp_sparse_lu_factor_products(const kmp_sparse_lu *s);
int64_t kmp_sparse_lu_solve_products(const kmp_sparse_lu *s);
