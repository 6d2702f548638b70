/* SPDX-License-Identifier: BSD-3-Clause */
/* A sparse square matrix in block-triangular form (SuiteSparse BTF), each diagonal block dense: the
 * loops of a mechanism are blocks of 2, 3 or 6. Large blocks with few entries, as of a grid of loops, have sparse
 * factors. Analysed once for a pattern; refactored at every evaluation without allocation, but where a large block
 * needs other pivots. */
#pragma once

#include "linalg/dense/dense.h"
#include <stdbool.h>

typedef struct kmp_block kmp_block;

/** n x n with nz entries (row[k], col[k]), no duplicates. NULL when there is no memory or the pattern is
 *  structurally singular. */
kmp_block *kmp_block_new(int n, int nz, const int *row, const int *col);
void kmp_block_free(kmp_block *b);

/** Numeric factors for new values of the same entries in the same order. Returns 0, or 1 + (the matrix column at fault)
 * when a diagonal block is singular. */
int kmp_block_factor(kmp_block *b, const double *values);

/** x <- A^-1 x, n x m with leading dimension n; x <- A^-T x, of n. Nothing for NULL, a matrix without rows. */
void kmp_block_solve(const kmp_block *b, int m, double *x);
void kmp_block_solve_transposed(const kmp_block *b, double *x);

/** As kmp_block_solve for one right-hand side, with room (n) of the caller. */
void kmp_block_solve_in(const kmp_block *b, double *x, double *room);

/** A^-T of a right-hand side with `count` entries, in columns of A, from which few blocks are reached: rows and values
 * (at most n) of the entries found. Smaller values than `nothing` are taken as zero. Returns their number. */
int kmp_block_solve_transposed_few(const kmp_block *b, double nothing, int count, const int *column,
                                   const double *value, int *row, double *x);

/** X (n x stride by rows, a row for each column of A) = A^-1 B (n x stride by rows), at runs of columns: the runs e
 * of block k go from start[k] to before start[k + 1], each from run[2 e] to before run[2 e + 1], multiples of four.
 * Elsewhere X stays as it is, which must be zero where another block reads it. Bits are the same as of kmp_block_solve.
 * Nothing for NULL. */
void kmp_block_solve_rows(const kmp_block *b, int stride, const int *start, const int *run, const double *right,
                          double *x);

/** As kmp_block_solve and kmp_block_solve_transposed for 4, 8 or 16 right-hand sides at once, a row of `width` numbers
 * for each equation, with the same bits. `right` has a row for each row of A, of the transposed for each column, and is
 * left as scratch there; X has the other ones. Nothing for NULL. */
void kmp_block_solve_wide(const kmp_block *b, int width, const double *right, double *x);
void kmp_block_solve_transposed_wide(const kmp_block *b, int width, double *right, double *x);

/** True if a factorisation may keep pivots of earlier values, on which roundings then depend. */
bool kmp_block_keeps_pivots(const kmp_block *b);

/** Number of diagonal blocks, 0 for NULL; block k holds `*count` matrix columns, returned. */
int kmp_block_count(const kmp_block *b);
const int *kmp_block_columns(const kmp_block *b, int k, int *count);
/** The size of the largest diagonal block, 0 for NULL. */
int kmp_block_largest(const kmp_block *b);
/** The matrix rows of a block. A row of block k has no columns of blocks before k. */
const int *kmp_block_rows(const kmp_block *b, int k);

/** Arithmetic of one factorisation; of one solve with one right-hand side, in the blocks that are used (NULL: all). */
kmp_flops kmp_block_factor_flops(const kmp_block *b);
kmp_flops kmp_block_solve_flops(const kmp_block *b, const char *used);

/** The sign of each diagonal block (kmp_block_count of them), up to one that the pattern fixes. If a factorisation has
 * other signs than an earlier one, some block has been singular in between. */
void kmp_block_take_signs(const kmp_block *b, int *signs);
bool kmp_block_has_signs(const kmp_block *b, const int *signs);

/** The smallest absolute pivot of the last factorisation. */
double kmp_block_smallest(const kmp_block *b);
