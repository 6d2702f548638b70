/* SPDX-License-Identifier: BSD-3-Clause */
/* Dense factorisations of small column-major matrices. Hides the unrolled cases of order 1, 2, 3; larger ones
 * are right-looking eliminations (Golub, Van Loan, Matrix Computations, 4th ed., sections 3.4 and 4.2). */
#include "linalg/dense/factors.h"

static inline void kmp_swap(double *a, double *b)
{
    double t = *a;
    *a = *b;
    *b = t;
}

static void swap_rows(int n, double *a, int i, int k)
{
    for (int j = 0; j < n; j++)
        kmp_swap(&a[i + j * n], &a[k + j * n]);
}

/* -- LU with partial pivoting ---------------------------------------------------------------------- */

/* No branch on which row is larger: it is often either. */
static int factor_2(double *a, int *pivot)
{
    int lower = fabs(a[1]) > fabs(a[0]);
    double u0 = a[lower], l = a[1 - lower] / u0, u01 = a[2 + lower], u1 = a[3 - lower] - l * u01;
    pivot[0] = lower;
    pivot[1] = 1;
    a[0] = u0;
    a[1] = l;
    a[2] = u01;
    a[3] = u1;
    return !kmp_is_usable(u0) ? 1 : kmp_is_usable(u1) ? 0 : 2;
}

static int factor_3(double *a, int *pivot)
{
    int p = fabs(a[1]) > fabs(a[0]);
    if (fabs(a[2]) > fabs(a[p]))
        p = 2;
    if (p)
        swap_rows(3, a, 0, p);
    if (!kmp_is_usable(a[0]))
        return 1;
    a[1] /= a[0];
    a[2] /= a[0];
    a[4] -= a[1] * a[3];
    a[5] -= a[2] * a[3];
    a[7] -= a[1] * a[6];
    a[8] -= a[2] * a[6];
    int q = fabs(a[5]) > fabs(a[4]) ? 2 : 1;
    if (q == 2)
        swap_rows(3, a, 1, 2);
    pivot[0] = p;
    pivot[1] = q;
    pivot[2] = 2;
    if (!kmp_is_usable(a[4]))
        return 2;
    a[5] /= a[4];
    a[8] -= a[5] * a[7];
    return kmp_is_usable(a[8]) ? 0 : 3;
}

static int factor_n(int n, double *a, int *pivot)
{
    for (int k = 0; k < n; k++) {
        double *ak = a + (ptrdiff_t)k * n;
        int p = k;
        for (int i = k + 1; i < n; i++)
            p = fabs(ak[i]) > fabs(ak[p]) ? i : p;
        pivot[k] = p;
        if (p != k)
            swap_rows(n, a, k, p);
        if (!kmp_is_usable(ak[k]))
            return k + 1;
        /* The column is eliminated below its pivot. */
        for (int i = k + 1; i < n; i++)
            ak[i] /= ak[k];
        for (int j = k + 1; j < n; j++) {
            double *restrict aj = a + (ptrdiff_t)j * n;
            double f = aj[k];
            if (f == 0) /* loops that are apart */
                continue;
            for (int i = k + 1; i < n; i++)
                aj[i] -= ak[i] * f;
        }
    }
    return 0;
}

KMP_LOCAL int kmp_lu_factor(int n, double *a, int *pivot)
{
    switch (n) {
    case 1:
        pivot[0] = 0;
        return kmp_is_usable(a[0]) ? 0 : 1;
    case 2:
        return factor_2(a, pivot);
    case 3:
        return factor_3(a, pivot);
    default:
        return factor_n(n, a, pivot);
    }
}

static void solve_n(int n, const double *lu, const int *pivot, double *b)
{
    for (int k = 0; k < n; k++)
        if (pivot[k] != k)
            kmp_swap(&b[k], &b[pivot[k]]);
    for (int k = 0; k < n; k++) {
        const double *l = lu + (ptrdiff_t)k * n;
        if (b[k] == 0)
            continue;
        for (int i = k + 1; i < n; i++)
            b[i] -= l[i] * b[k];
    }
    for (int k = n - 1; k >= 0; k--) {
        const double *u = lu + (ptrdiff_t)k * n;
        if (b[k] == 0)
            continue;
        b[k] /= u[k];
        for (int i = 0; i < k; i++)
            b[i] -= u[i] * b[k];
    }
}

KMP_LOCAL void kmp_lu_solve(int n, const double *lu, const int *pivot, int m, double *b)
{
    for (int j = 0; j < m; j++, b += n) {
        if (n == 1)
            b[0] /= lu[0];
        else if (n == 2) {
            int p = pivot[0];
            double b0 = b[p], b1 = b[1 - p] - lu[1] * b0;
            b[1] = b1 / lu[3];
            b[0] = (b0 - lu[2] * b[1]) / lu[0];
        } else
            solve_n(n, lu, pivot, b);
    }
}

/* A' = U' L' P, so: forward with U', backward with L', exchanges in reverse. */
KMP_LOCAL void kmp_lu_solve_transposed(int n, const double *lu, const int *pivot, double *b)
{
    for (int k = 0; k < n; k++) {
        const double *u = lu + (ptrdiff_t)k * n;
        double s = b[k];
        for (int i = 0; i < k; i++)
            s -= u[i] * b[i];
        b[k] = s / u[k];
    }
    for (int k = n - 2; k >= 0; k--) {
        const double *l = lu + (ptrdiff_t)k * n;
        double s = b[k];
        for (int i = k + 1; i < n; i++)
            s -= l[i] * b[i];
        b[k] = s;
    }
    for (int k = n - 1; k >= 0; k--)
        if (pivot[k] != k)
            kmp_swap(&b[k], &b[pivot[k]]);
}

/* -- Cholesky -------------------------------------------------------------------------------------- */

KMP_LOCAL int kmp_cholesky_factor(int n, double *a)
{
    for (int k = 0; k < n; k++) {
        double *ak = a + (ptrdiff_t)k * n;
        if (!(ak[k] > 0.0 && ak[k] <= DBL_MAX))
            return k + 1;
        ak[k] = sqrt(ak[k]);
        for (int i = k + 1; i < n; i++)
            ak[i] /= ak[k];
        for (int j = k + 1; j < n; j++) {
            double *restrict aj = a + (ptrdiff_t)j * n;
            double f = ak[j];
            for (int i = j; i < n; i++)
                aj[i] -= ak[i] * f;
        }
    }
    return 0;
}

KMP_LOCAL void kmp_cholesky_forward(int n, const double *l, double *b)
{
    for (int k = 0; k < n; k++) {
        const double *lk = l + (ptrdiff_t)k * n;
        b[k] /= lk[k];
        for (int i = k + 1; i < n; i++)
            b[i] -= lk[i] * b[k];
    }
}

KMP_LOCAL void kmp_cholesky_backward(int n, const double *l, double *b)
{
    for (int k = n - 1; k >= 0; k--) {
        const double *lk = l + (ptrdiff_t)k * n;
        double s = b[k];
        for (int i = k + 1; i < n; i++)
            s -= lk[i] * b[i];
        b[k] = s / lk[k];
    }
}

KMP_LOCAL void kmp_cholesky_solve(int n, const double *l, double *b)
{
    kmp_cholesky_forward(n, l, b);
    kmp_cholesky_backward(n, l, b);
}

/* -- LU with complete pivoting --------------------------------------------------------------------- */

/* The column of the next pivot, which has the largest entry. A free column precedes a fixed one, then the larger entry,
 * then the smaller original column. */
typedef struct candidate {
    int column; /* in the permuted matrix; -1: none yet */
    int fixed;
    double size;
} candidate;

static void consider(candidate *best, int column, double size, const int *fixed, const int *c)
{
    int is_fixed = fixed && fixed[c[column]];
    bool takes = best->column < 0 || is_fixed < best->fixed;
    if (!takes && is_fixed == best->fixed)
        takes = size > best->size || (!(size < best->size) && c[column] < c[best->column]);
    if (takes)
        *best = (candidate){column, is_fixed, size};
}

/* The sizes of this number of columns are kept between pivots. A column without entry in the pivot's row is unchanged.
 */
enum { KEPT = 256 };

/* Eliminates column k, if its pivot is usable, and finds the sizes of the columns that have changed. */
static void eliminate_sparse(int m, int n, int k, bool pivots, double *a, double *largest)
{
    double *ak = a + (ptrdiff_t)k * m;
    for (int i = k + 1; pivots && i < m; i++)
        ak[i] /= ak[k];
    for (int j = k + 1; j < n; j++) {
        double *restrict aj = a + (ptrdiff_t)j * m, f = aj[k];
        if (f == 0)
            continue;
        for (int i = k + 1; pivots && i < m; i++)
            aj[i] -= ak[i] * f;
        if (n <= KEPT)
            largest[j] = kmp_largest_size(m, k + 1, aj);
    }
}

KMP_LOCAL void kmp_lu_complete(int m, int n, double *a, const int *fixed, int *r, int *c, double *pivots)
{
    double largest[KEPT];
    for (int i = 0; i < m; i++)
        r[i] = i;
    for (int j = 0; j < n; j++) {
        c[j] = j;
        if (n <= KEPT)
            largest[j] = kmp_largest_size(m, 0, a + (ptrdiff_t)j * m);
    }
    for (int k = 0; k < m && k < n; k++) {
        /* The largest entry that is left. */
        candidate best = {.column = -1};
        for (int j = k; j < n; j++)
            consider(&best, j, n <= KEPT ? largest[j] : kmp_largest_size(m, k, a + (ptrdiff_t)j * m), fixed, c);
        /* Exchanges the pivot's row and column with the row and column of place k. */
        int row = kmp_row_of_size(m, k, best.size, a + (ptrdiff_t)best.column * m, r);
        int column = best.column;
        for (int j = 0; row != k && j < n; j++)
            kmp_swap(&a[k + j * m], &a[row + j * m]);
        for (int i = 0; column != k && i < m; i++)
            kmp_swap(&a[i + k * m], &a[i + column * m]);
        kmp_swap_int(&r[k], &r[row]);
        kmp_swap_int(&c[k], &c[column]);
        if (n <= KEPT)
            largest[best.column] = largest[k];
        pivots[k] = fabs(a[k + k * m]);
        eliminate_sparse(m, n, k, kmp_is_usable(pivots[k]), a, largest);
    }
}

/* -- exchange of columns ----------------------------------------------------------------------------- */

KMP_LOCAL void kmp_lu_null_vector(int m, int n, const double *lu, const int *c, int rank, int one, double *x)
{
    for (int j = 0; j < n; j++)
        x[j] = 0;
    x[c[one]] = 1;
    for (int i = rank - 1; i >= 0; i--) {
        double sum = lu[i + one * m];
        for (int j = i + 1; j < rank; j++)
            sum += lu[i + j * m] * x[c[j]];
        x[c[i]] = -sum / lu[i + i * m];
    }
}

KMP_LOCAL bool kmp_exchange_column(int r, int i, const double *restrict leaving, double *restrict column)
{
    double part = column[i] / leaving[i];
    if (!(fabs(part) > 0))
        return false;
    for (int l = 0; l < r; l++)
        column[l] -= leaving[l] * part;
    column[i] = -part;
    return true;
}

KMP_LOCAL void kmp_exchange_pivot(int r, int i, double *column)
{
    double pivot = column[i];
    for (int l = 0; l < r; l++)
        column[l] /= pivot;
    column[i] = 1 / pivot;
}
