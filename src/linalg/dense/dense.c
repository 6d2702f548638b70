/* SPDX-License-Identifier: BSD-3-Clause */
#include "linalg/dense/dense.h"

#include <string.h>

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
            kmp_swap(&re[k + (ptrdiff_t)j * n], &re[p + (ptrdiff_t)j * n]);
            kmp_swap(&im[k + (ptrdiff_t)j * n], &im[p + (ptrdiff_t)j * n]);
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
            kmp_swap(&b_re[k], &b_re[pivot[k]]);
            kmp_swap(&b_im[k], &b_im[pivot[k]]);
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

/* Columns keep their places, finished rows make room; `largest` is by position in c. A column without entry in the
 * pivot's row is unchanged. */
void kmp_pivots_complete(int m, int n, double *a, double *largest, int *r, int *c, double *pivots)
{
    for (int i = 0; i < m; i++)
        r[i] = i;
    for (int j = 0; j < n; j++) {
        c[j] = j;
        largest[j] = kmp_largest_size(m, 0, a + (ptrdiff_t)j * m);
    }
    for (int k = 0; k < m && k < n; k++) {
        /* The pivot's column, by its position in c. */
        int at = k;
        for (int j = k + 1; j < n; j++)
            if (largest[j] > largest[at] || (!(largest[j] < largest[at]) && c[j] < c[at]))
                at = j;
        double *l = a + (ptrdiff_t)c[at] * m;
        int row = kmp_row_of_size(m, k, largest[at], l, r);
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
            largest[j] = kmp_is_usable(pivot) ? subtract(m, k + 1, x, l, column) : kmp_largest_size(m, k + 1, column);
        }
    }
}
