/* SPDX-License-Identifier: BSD-3-Clause */
/* What large mechanisms need of sparse matrices: the complete pivoting of dense.h at the cost of its non-zeros, and
 * square systems by SuiteSparse KLU. Entries are (row[k], col[k]), none twice. */
#ifndef KMP_LINALG_SPARSE_H
#define KMP_LINALG_SPARSE_H

#include <stdbool.h>

/** As kmp_lu_complete: the same r, c and pivots to the last bit, without the factors; all pivots are NaN when an entry
 * is not finite. *products: how many were formed (NULL: not asked). false: no memory. */
bool kmp_sparse_complete(int m, int n, int nz, const int *row, const int *col, const double *value, const int *fixed,
                         int *r, int *c, double *pivots, long *products);

/** A square matrix, analysed once for its pattern. */
typedef struct kmp_sparse kmp_sparse;

/** NULL when there is no memory or the pattern is structurally singular (kmp_memory_failures tells which). */
kmp_sparse *kmp_sparse_new(int n, int nz, const int *row, const int *col);
void kmp_sparse_free(kmp_sparse *s);

/** Factors for the values of the same entries in the same order: with the pivots at hand where they still suit, with
 * new ones otherwise. 0, or 1 when singular; the factors are then unusable. */
int kmp_sparse_factor(kmp_sparse *s, const double *values);

/** x <- A^-1 x; x is n x m, leading dimension n. */
void kmp_sparse_solve(kmp_sparse *s, int m, double *x);

/** ||A||_1 and an estimate, from below and rarely by more than 3 times too small, of ||A^-1||_1 (Hager 1984; Higham,
 * ACM TOMS 14 (1988) 381). */
void kmp_sparse_norms(kmp_sparse *s, double *norm, double *inverse);

#endif
