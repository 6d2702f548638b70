/* SPDX-License-Identifier: BSD-3-Clause */
/* Dense factorisations of small column-major matrices without allocation, for the library and for generated simulators:
 * C99, no library but libm. Other operations are in linalg/dense/dense.h. */

#ifndef KMP_FACTORS_H
#define KMP_FACTORS_H

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stddef.h>

/* Linkage; static if one file contains all of a generated simulator. */
#ifndef KMP_LOCAL
#define KMP_LOCAL
#endif

static inline void kmp_swap_int(int *a, int *b)
{
    int t = *a;
    *a = *b;
    *b = t;
}

/* a is n x n with leading dimension n throughout; element (i, j) is a[i + j*n]. */

/** LU with partial pivoting in place; pivot[k] is the row exchanged with row k. Returns 0, or k + 1 when
 *  pivot k is zero or not finite (the factors are then unusable). */
KMP_LOCAL int kmp_lu_factor(int n, double *a, int *pivot);

/** b <- A^-1 b, n x m with leading dimension n, and b <- A^-T b, of n, from the factors. */
KMP_LOCAL void kmp_lu_solve(int n, const double *lu, const int *pivot, int m, double *b);
KMP_LOCAL void kmp_lu_solve_transposed(int n, const double *lu, const int *pivot, double *b);

/** Cholesky of the lower triangle in place. Returns 0, or k + 1 when minor k is not positive. */
KMP_LOCAL int kmp_cholesky_factor(int n, double *a);
KMP_LOCAL void kmp_cholesky_solve(int n, const double *l, double *b);

/** The halves of a Cholesky solution: b <- L^-1 b and b <- L^-T b. */
KMP_LOCAL void kmp_cholesky_forward(int n, const double *l, double *b);
KMP_LOCAL void kmp_cholesky_backward(int n, const double *l, double *b);

/** Rank-revealing LU with complete pivoting of an m x n matrix in place (leading dimension m). Row r[k] and column c[k]
 * of the original are the k-th pivot's; r and c are permutations of all rows and columns. pivots[0 .. min(m, n)) are
 * the absolute pivots, in order. Ties are broken by the smaller index, columns first. Columns with fixed[j] true are
 * pivoted last of all (NULL: none). The rank is the caller's decision, relative to pivots[0]. */
KMP_LOCAL void kmp_lu_complete(int m, int n, double *a, const int *fixed, int *r, int *c, double *pivots);

/** x (n) with A x = 0 as far as the first `rank` pivots of kmp_lu_complete determine it: 1 in the column of pivot `one`
 * (>= rank). It is 0 in the columns of all other pivots after `rank`. */
KMP_LOCAL void kmp_lu_null_vector(int m, int n, const double *lu, const int *c, int rank, int one, double *x);

/** Of v = B u, B r x p, v_i and u_k are exchanged: `leaving` is column k of B, and `column` another one, which the
 * first function updates; false: it stays as it is. The second one then updates column k. */
KMP_LOCAL bool kmp_exchange_column(int r, int i, const double *restrict leaving, double *restrict column);
KMP_LOCAL void kmp_exchange_pivot(int r, int i, double *column);

/* -- parts of eliminations ---------------------------------------------------------------------------- */

/* False for zero, infinity and NaN. */
static inline int kmp_is_usable(double pivot)
{
    double size = fabs(pivot);
    return size > 0.0 && size <= DBL_MAX;
}

/* The row of the next pivot: of several largest entries the one in the smallest original row. */
static inline int kmp_row_of_size(int m, int k, double size, const double *column, const int *r)
{
    int row = -1;
    for (int i = k; i < m; i++)
        if (!(fabs(column[i]) < size) && (row < 0 || r[i] < r[row]))
            row = i;
    return row < 0 ? k : row;
}

/* Largest size from row k on. */
static inline double kmp_largest_size(int m, int k, const double *column)
{
    double part[4] = {0};
    int i = k;
    for (; i + 4 <= m; i += 4)
        for (int l = 0; l < 4; l++) {
            double x = fabs(column[i + l]);
            part[l] = x > part[l] ? x : part[l];
        }
    for (; i < m; i++) {
        double x = fabs(column[i]);
        part[0] = x > part[0] ? x : part[0];
    }
    double a = part[0] > part[1] ? part[0] : part[1], b = part[2] > part[3] ? part[2] : part[3];
    return a > b ? a : b;
}

#endif
