/* SPDX-License-Identifier: BSD-3-Clause */
/* Small dense linear algebra, column-major, without allocation: for the hot path of a small mechanism. Larger or
 * general tasks use LAPACK (linalg/dense/lapack.h), KLU or UMFPACK (integrators/sundials/linear.def). */
#pragma once

static inline void kmp_swap_int(int *a, int *b)
{
    int t = *a;
    *a = *b;
    *b = t;
}

/* a is n x n with leading dimension n throughout; element (i, j) is a[i + j*n]. */

/** LU with partial pivoting in place; pivot[k] is the row exchanged with row k. Returns 0, or k + 1 when
 *  pivot k is zero or not finite (the factors are then unusable). */
int kmp_lu_factor(int n, double *a, int *pivot);

/** b <- A^-1 b, n x m with leading dimension n, and b <- A^-T b, of n, from the factors. */
void kmp_lu_solve(int n, const double *lu, const int *pivot, int m, double *b);
void kmp_lu_solve_transposed(int n, const double *lu, const int *pivot, double *b);

/** LU and solution of a complex matrix, with real and imaginary parts in separate arrays, and one right-hand side. */
int kmp_lu_complex_factor(int n, double *re, double *im, int *pivot);
void kmp_lu_complex_solve(int n, const double *re, const double *im, const int *pivot, double *b_re, double *b_im);

/** Cholesky of the lower triangle in place. Returns 0, or k + 1 when minor k is not positive. */
int kmp_cholesky_factor(int n, double *a);
void kmp_cholesky_solve(int n, const double *l, double *b);

/** The halves of a Cholesky solution: b <- L^-1 b and b <- L^-T b. */
void kmp_cholesky_forward(int n, const double *l, double *b);
void kmp_cholesky_backward(int n, const double *l, double *b);

/** Arithmetic of one call; comparisons, signs and moves are none. */
typedef struct kmp_flops {
    long add, mul, div, root;
} kmp_flops;

static inline void kmp_flops_add(kmp_flops *sum, long times, kmp_flops f)
{
    sum->add += times * f.add;
    sum->mul += times * f.mul;
    sum->div += times * f.div;
    sum->root += times * f.root;
}

kmp_flops kmp_lu_flops(int n);
kmp_flops kmp_cholesky_factor_flops(int n);
kmp_flops kmp_cholesky_solve_flops(int n);

/** Rank-revealing LU with complete pivoting of an m x n matrix in place (leading dimension m). Row r[k] and column c[k]
 * of the original are the k-th pivot's; r and c are permutations of all rows and columns. pivots[0 .. min(m, n)) are
 * the absolute pivots, in order. Ties are broken by the smaller index, columns first. Columns with fixed[j] true are
 * pivoted last of all (NULL: none). The rank is the caller's decision, relative to pivots[0]. */
void kmp_lu_complete(int m, int n, double *a, const int *fixed, int *r, int *c, double *pivots);

/** x (n) with A x = 0 as far as the first `rank` pivots of kmp_lu_complete determine it: 1 in the column of pivot `one`
 * (>= rank). It is 0 in the columns of all other pivots after `rank`. */
void kmp_lu_null_vector(int m, int n, const double *lu, const int *c, int rank, int one, double *x);

/** The r, c and pivots of kmp_lu_complete to the last bit where no column is fixed, in less time. `a` and `largest` (n)
 * are left as scratch. */
void kmp_pivots_complete(int m, int n, double *a, double *largest, int *r, int *c, double *pivots);
