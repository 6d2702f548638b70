/* SPDX-License-Identifier: BSD-3-Clause */
/* Dense factorisations of small column-major matrices. Hides the unrolled cases of order 1, 2, 3; larger ones
 * are right-looking eliminations (Golub, Van Loan, Matrix Computations, 4th ed., sections 3.4 and 4.2). */
#include "linalg/dense/dense.h"

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <string.h>

/* False for zero, infinity and NaN. */
static int usable(double pivot)
{
    double size = fabs(pivot);
    return size > 0.0 && size <= DBL_MAX;
}

static void swap(double *a, double *b)
{
    double t = *a;
    *a = *b;
    *b = t;
}

static void swap_rows(int n, double *a, int i, int k)
{
    for (int j = 0; j < n; j++)
        swap(&a[i + j * n], &a[k + j * n]);
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
    return !usable(u0) ? 1 : usable(u1) ? 0 : 2;
}

static int factor_3(double *a, int *pivot)
{
    int p = fabs(a[1]) > fabs(a[0]);
    if (fabs(a[2]) > fabs(a[p]))
        p = 2;
    if (p)
        swap_rows(3, a, 0, p);
    if (!usable(a[0]))
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
    if (!usable(a[4]))
        return 2;
    a[5] /= a[4];
    a[8] -= a[5] * a[7];
    return usable(a[8]) ? 0 : 3;
}

static int largest_below(int n, const double *column, int k)
{
    int p = k;
    for (int i = k + 1; i < n; i++)
        if (fabs(column[i]) > fabs(column[p]))
            p = i;
    return p;
}

/* Eliminates column k below its pivot. */
static void eliminate(int m, int n, int k, double *a)
{
    double *ak = a + (ptrdiff_t)k * m;
    for (int i = k + 1; i < m; i++)
        ak[i] /= ak[k];
    for (int j = k + 1; j < n; j++) {
        double *restrict aj = a + (ptrdiff_t)j * m;
        double f = aj[k];
        for (int i = k + 1; i < m; i++)
            aj[i] -= ak[i] * f;
    }
}

static int factor_n(int n, double *a, int *pivot)
{
    for (int k = 0; k < n; k++) {
        double *ak = a + (ptrdiff_t)k * n;
        int p = pivot[k] = largest_below(n, ak, k);
        if (p != k)
            swap_rows(n, a, k, p);
        if (!usable(ak[k]))
            return k + 1;
        eliminate(n, n, k, a);
    }
    return 0;
}

int kmp_lu_factor(int n, double *a, int *pivot)
{
    switch (n) {
    case 1:
        pivot[0] = 0;
        return usable(a[0]) ? 0 : 1;
    case 2:
        return factor_2(a, pivot);
    case 3:
        return factor_3(a, pivot);
    default:
        return factor_n(n, a, pivot);
    }
}

static void solve_2(const double *lu, const int *pivot, double *b)
{
    int p = pivot[0];
    double b0 = b[p], b1 = b[1 - p] - lu[1] * b0;
    b[1] = b1 / lu[3];
    b[0] = (b0 - lu[2] * b[1]) / lu[0];
}

static void solve_n(int n, const double *lu, const int *pivot, double *b)
{
    for (int k = 0; k < n; k++)
        if (pivot[k] != k)
            swap(&b[k], &b[pivot[k]]);
    for (int k = 0; k < n; k++) {
        const double *l = lu + (ptrdiff_t)k * n;
        for (int i = k + 1; i < n; i++)
            b[i] -= l[i] * b[k];
    }
    for (int k = n - 1; k >= 0; k--) {
        const double *u = lu + (ptrdiff_t)k * n;
        b[k] /= u[k];
        for (int i = 0; i < k; i++)
            b[i] -= u[i] * b[k];
    }
}

void kmp_lu_solve(int n, const double *lu, const int *pivot, int m, double *b)
{
    for (int j = 0; j < m; j++, b += n) {
        if (n == 1)
            b[0] /= lu[0];
        else if (n == 2)
            solve_2(lu, pivot, b);
        else
            solve_n(n, lu, pivot, b);
    }
}

/* A' = U' L' P, so: forward with U', backward with L', exchanges in reverse. */
void kmp_lu_solve_transposed(int n, const double *lu, const int *pivot, double *b)
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
            swap(&b[k], &b[pivot[k]]);
}

/* -- complex LU ------------------------------------------------------------------------------------- */

/* Real and imaginary parts are in separate arrays. Pivots are chosen by the sum of absolute values; each is kept as its
 * reciprocal. */
static double size_at(const double *re, const double *im, int i)
{
    return fabs(re[i]) + fabs(im[i]);
}

/* 1 / (re + i im) in place, without overflow or underflow. False: zero or not finite. */
static int invert(double *re, double *im)
{
    double scale = fmax(fabs(*re), fabs(*im));
    if (!(scale > 0.0 && fabs(*re) + fabs(*im) <= DBL_MAX))
        return 0;
    double x = *re / scale, y = *im / scale, square = x * x + y * y;
    *re = x / square / scale;
    *im = -y / square / scale;
    return 1;
}

/* column j -= column k * f below row k */
static void eliminate_complex(int n, int k, const double *re_k, const double *im_k, double *restrict re_j,
                              double *restrict im_j)
{
    double x = re_j[k], y = im_j[k];
    for (int i = k + 1; i < n; i++) {
        re_j[i] -= re_k[i] * x - im_k[i] * y;
        im_j[i] -= re_k[i] * y + im_k[i] * x;
    }
}

int kmp_lu_complex_factor(int n, double *re, double *im, int *pivot)
{
    for (int k = 0; k < n; k++) {
        double *re_k = re + (ptrdiff_t)k * n, *im_k = im + (ptrdiff_t)k * n;
        int p = k;
        for (int i = k + 1; i < n; i++)
            p = size_at(re_k, im_k, i) > size_at(re_k, im_k, p) ? i : p;
        pivot[k] = p;
        for (int j = 0; j < n && p != k; j++) {
            swap(&re[k + (ptrdiff_t)j * n], &re[p + (ptrdiff_t)j * n]);
            swap(&im[k + (ptrdiff_t)j * n], &im[p + (ptrdiff_t)j * n]);
        }
        if (!invert(re_k + k, im_k + k))
            return k + 1;
        for (int i = k + 1; i < n; i++) {
            double x = re_k[i], y = im_k[i];
            re_k[i] = x * re_k[k] - y * im_k[k];
            im_k[i] = x * im_k[k] + y * re_k[k];
        }
        for (int j = k + 1; j < n; j++)
            eliminate_complex(n, k, re_k, im_k, re + (ptrdiff_t)j * n, im + (ptrdiff_t)j * n);
    }
    return 0;
}

void kmp_lu_complex_solve(int n, const double *re, const double *im, const int *pivot, double *b_re, double *b_im)
{
    for (int k = 0; k < n; k++)
        if (pivot[k] != k) {
            swap(&b_re[k], &b_re[pivot[k]]);
            swap(&b_im[k], &b_im[pivot[k]]);
        }
    for (int k = 0; k < n; k++)
        eliminate_complex(n, k, re + (ptrdiff_t)k * n, im + (ptrdiff_t)k * n, b_re, b_im);
    for (int k = n - 1; k >= 0; k--) {
        const double *re_k = re + (ptrdiff_t)k * n, *im_k = im + (ptrdiff_t)k * n;
        double x = b_re[k] * re_k[k] - b_im[k] * im_k[k], y = b_re[k] * im_k[k] + b_im[k] * re_k[k];
        b_re[k] = x;
        b_im[k] = y;
        for (int i = 0; i < k; i++) {
            b_re[i] -= re_k[i] * x - im_k[i] * y;
            b_im[i] -= re_k[i] * y + im_k[i] * x;
        }
    }
}

/* -- Cholesky -------------------------------------------------------------------------------------- */

int kmp_cholesky_factor(int n, double *a)
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

void kmp_cholesky_forward(int n, const double *l, double *b)
{
    for (int k = 0; k < n; k++) {
        const double *lk = l + (ptrdiff_t)k * n;
        b[k] /= lk[k];
        for (int i = k + 1; i < n; i++)
            b[i] -= lk[i] * b[k];
    }
}

void kmp_cholesky_backward(int n, const double *l, double *b)
{
    for (int k = n - 1; k >= 0; k--) {
        const double *lk = l + (ptrdiff_t)k * n;
        double s = b[k];
        for (int i = k + 1; i < n; i++)
            s -= lk[i] * b[i];
        b[k] = s / lk[k];
    }
}

void kmp_cholesky_solve(int n, const double *l, double *b)
{
    kmp_cholesky_forward(n, l, b);
    kmp_cholesky_backward(n, l, b);
}

/* -- counts ---------------------------------------------------------------------------------------- */

kmp_flops kmp_lu_flops(int n)
{
    long products = (long)(n - 1) * n * (2L * n - 1) / 6;
    return (kmp_flops){.add = products, .mul = products, .div = (long)n * (n - 1) / 2};
}

kmp_flops kmp_cholesky_factor_flops(int n)
{
    kmp_flops f = {.div = (long)n * (n - 1) / 2, .root = n};
    for (long k = 1; k < n; k++)
        f.add += k * (k + 1) / 2;
    f.mul = f.add;
    return f;
}

kmp_flops kmp_cholesky_solve_flops(int n)
{
    long products = (long)n * (n - 1);
    return (kmp_flops){.add = products, .mul = products, .div = 2L * n};
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

/* The row of the next pivot: of several largest entries the one in the smallest original row. */
static int row_of(int m, int k, double size, const double *column, const int *r)
{
    int row = -1;
    for (int i = k; i < m; i++)
        if (!(fabs(column[i]) < size) && (row < 0 || r[i] < r[row]))
            row = i;
    return row < 0 ? k : row;
}

/* Largest size from row k on. */
static double size_of(int m, int k, const double *column)
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

/* The sizes of so many columns are kept between pivots. A column without entry in the pivot's row is unchanged. */
enum { KEPT = 256 };

static candidate largest_entry(int m, int n, int k, const double *a, const double *largest, const int *fixed,
                               const int *c)
{
    candidate best = {.column = -1};
    for (int j = k; j < n; j++)
        consider(&best, j, n <= KEPT ? largest[j] : size_of(m, k, a + (ptrdiff_t)j * m), fixed, c);
    return best;
}

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
            largest[j] = size_of(m, k + 1, aj);
    }
}

static void exchange(int m, int n, int k, int row, int column, double *a, int *r, int *c)
{
    for (int j = 0; row != k && j < n; j++)
        swap(&a[k + j * m], &a[row + j * m]);
    for (int i = 0; column != k && i < m; i++)
        swap(&a[i + k * m], &a[i + column * m]);
    kmp_swap_int(&r[k], &r[row]);
    kmp_swap_int(&c[k], &c[column]);
}

void kmp_lu_complete(int m, int n, double *a, const int *fixed, int *r, int *c, double *pivots)
{
    double largest[KEPT];
    for (int i = 0; i < m; i++)
        r[i] = i;
    for (int j = 0; j < n; j++) {
        c[j] = j;
        if (n <= KEPT)
            largest[j] = size_of(m, 0, a + (ptrdiff_t)j * m);
    }
    for (int k = 0; k < m && k < n; k++) {
        candidate best = largest_entry(m, n, k, a, largest, fixed, c);
        exchange(m, n, k, row_of(m, k, best.size, a + (ptrdiff_t)best.column * m, r), best.column, a, r, c);
        if (n <= KEPT)
            largest[best.column] = largest[k];
        pivots[k] = fabs(a[k + k * m]);
        eliminate_sparse(m, n, k, usable(pivots[k]), a, largest);
    }
}

void kmp_lu_null_vector(int m, int n, const double *lu, const int *c, int rank, int one, double *x)
{
    memset(x, 0, (size_t)n * sizeof *x);
    x[c[one]] = 1;
    for (int i = rank - 1; i >= 0; i--) {
        double sum = lu[i + one * m];
        for (int j = i + 1; j < rank; j++)
            sum += lu[i + j * m] * x[c[j]];
        x[c[i]] = -sum / lu[i + i * m];
    }
}

/* -- pivots alone ------------------------------------------------------------------------------------- */

/* Replaces row i of a column by row `first`, for elimination without row i. Returns the replaced entry. */
static double leave_out(double *column, int first, int i)
{
    double x = column[i];
    column[i] = column[first];
    return x;
}

/* column -= l x below `first`; returns its largest entry there. */
static double subtract(int m, int first, double x, const double *restrict l, double *restrict column)
{
    double largest = 0.0;
    for (int i = first; i < m; i++) {
        column[i] -= l[i] * x;
        largest = fabs(column[i]) > largest ? fabs(column[i]) : largest;
    }
    return largest;
}

/* The pivot's column, by its position in c. */
static int largest_column(int n, int k, const double *largest, const int *c)
{
    int best = k;
    for (int j = k + 1; j < n; j++)
        if (largest[j] > largest[best] || (!(largest[j] < largest[best]) && c[j] < c[best]))
            best = j;
    return best;
}

/* Columns keep their places, finished rows make room; `largest` is by position in c. A column without entry in the
 * pivot's row is unchanged. */
void kmp_pivots_complete(int m, int n, double *a, double *largest, int *r, int *c, double *pivots)
{
    for (int i = 0; i < m; i++)
        r[i] = i;
    for (int j = 0; j < n; j++) {
        c[j] = j;
        largest[j] = size_of(m, 0, a + (ptrdiff_t)j * m);
    }
    for (int k = 0; k < m && k < n; k++) {
        int at = largest_column(n, k, largest, c);
        double *l = a + (ptrdiff_t)c[at] * m;
        int row = row_of(m, k, largest[at], l, r);
        double pivot = leave_out(l, k, row);
        kmp_swap_int(&r[k], &r[row]);
        kmp_swap_int(&c[k], &c[at]);
        largest[at] = largest[k];
        pivots[k] = fabs(pivot);
        for (int i = k + 1; i < m; i++)
            l[i] /= pivot;
        for (int j = k + 1; j < n; j++) {
            double *column = a + (ptrdiff_t)c[j] * m, x = leave_out(column, k, row);
            if (x == 0.0)
                continue;
            largest[j] = usable(pivot) ? subtract(m, k + 1, x, l, column) : size_of(m, k + 1, column);
        }
    }
}
