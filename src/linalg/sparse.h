/* SPDX-License-Identifier: BSD-3-Clause */
/* Sparse matrices for large mechanisms: the complete pivoting of dense.h at the cost of the non-zeros, and square
 * systems by SuiteSparse KLU. Entries are (row[k], col[k]), none twice. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

/* m x n */
typedef struct kmp_entries {
    int m, n, nz;
    const int *row, *col;
    const double *value;
} kmp_entries;

/** A square matrix, analysed once for its pattern. */
typedef struct kmp_sparse kmp_sparse;

/** A symmetric pattern is analysed without the block-triangular form, which takes n^2 in long chains and finds nothing
 * in it. NULL: no memory or, if not symmetric, a structurally singular pattern (kmp_memory_failures distinguishes
 * them).
 */
kmp_sparse *kmp_sparse_new(int n, int nz, const int *row, const int *col, bool symmetric);

/** A saddle system [A -J'; J D] of n coordinates and then r multipliers, A positive definite; group (r): equal numbers
 * for the rows of a closure, one after another. A diagonal with too few pivots in the order of least degree
 * brings an order by closures (saddle_order.h). NULL: no memory. */
kmp_sparse *kmp_sparse_new_saddle(int n, int r, int nz, const int *row, const int *col, const int *group);

/** The entries in compressed columns, whose `start` (n + 1) is zero before: their rows, and the place of each given
 * entry among them. */
void kmp_sparse_compress(int n, int nz, const int *row, const int *col, int64_t *start, int64_t *rows, int *place);

/** Sorts entries by their columns, which are below n. order (count) lists their numbers, column after column; start
 * (n + 1, zero before) has the place in it where each column begins. */
void kmp_sort_entries(int n, int count, const int *col, int *start, int *order);

/** For the iteration matrix of an integrator, of at most nz entries. NULL: no memory. */
kmp_sparse *kmp_sparse_new_columns(int n, int nz);

/** Takes compressed columns, once, before it is factored with values in their order. Uses only the memory of KLU;
 * false: no memory. */
bool kmp_sparse_take_columns(kmp_sparse *s, const int64_t *start, const int64_t *row);
void kmp_sparse_free(kmp_sparse *s);

typedef enum kmp_sparse_outcome {
    KMP_SPARSE_FACTORED = 0,
    KMP_SPARSE_SINGULAR,
    KMP_SPARSE_NO_MEMORY,
    KMP_SPARSE_FAILED
} kmp_sparse_outcome;

/** Factors new values of the same entries in the same order: with the current pivots where they still suit, with new
 * ones otherwise. */
kmp_sparse_outcome kmp_sparse_factor(kmp_sparse *s, const double *values);

/** Operations of a factorisation and a solution, estimated from the pattern. Each costs KMP_SPARSE_COST times as much
 * as one in a dense matrix. */
double kmp_sparse_operations(const kmp_sparse *s);
#define KMP_SPARSE_COST 8.0

/** Entries of L, U and the blocks off the diagonal, as last factored; 0: there are no factors. */
int64_t kmp_sparse_fill(const kmp_sparse *s);

/** x <- A^-1 x; x is n x m, leading dimension n. false, and x as it was: there are no factors. */
bool kmp_sparse_solve(kmp_sparse *s, int m, double *x);

/** ||A||_1 and an estimate, from below and rarely by more than 3 times too small, of ||A^-1||_1 (Hager 1984; Higham,
 * ACM TOMS 14 (1988) 381). */
void kmp_sparse_norms(kmp_sparse *s, double *norm, double *inverse);

/** Complete pivoting as kmp_lu_complete, without the factors: r, c and pivots agree to the last bit. If this order of
 * pivots would fill the matrix, entries down to a quarter of the largest are also accepted, and the entry that fills
 * least goes first. This is threshold complete pivoting (Gill, Murray, Saunders, SIAM Review 47 (2005) 99); r, c and
 * pivots are then sorted by the size of the pivots. All pivots are NaN when an entry is not finite. *products (NULL:
 * not wanted): the number of products formed. False: no memory. */
bool kmp_sparse_complete(const kmp_entries *a, const int *fixed, int *r, int *c, double *pivots, int64_t *products);
