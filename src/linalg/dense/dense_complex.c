/* SPDX-License-Identifier: BSD-3-Clause */
/* LU with partial pivoting of complex matrices, real and imaginary parts in separate arrays. Right-looking elimination
 * by columns (Golub, Van Loan, Matrix Computations, 4th ed., section 3.4), pivots by the sum of absolute values. Each
 * pivot is kept as its reciprocal. */
#include "linalg/dense/dense.h"

#include <float.h>
#include <math.h>
#include <stddef.h>

static void swap(double *a, int i, int k)
{
    double t = a[i];
    a[i] = a[k];
    a[k] = t;
}

static double size(const double *re, const double *im, int i)
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
static void eliminate(int n, int k, const double *re_k, const double *im_k, double *restrict re_j,
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
            p = size(re_k, im_k, i) > size(re_k, im_k, p) ? i : p;
        pivot[k] = p;
        for (int j = 0; j < n && p != k; j++) {
            swap(re + (ptrdiff_t)j * n, k, p);
            swap(im + (ptrdiff_t)j * n, k, p);
        }
        if (!invert(re_k + k, im_k + k))
            return k + 1;
        for (int i = k + 1; i < n; i++) {
            double x = re_k[i], y = im_k[i];
            re_k[i] = x * re_k[k] - y * im_k[k];
            im_k[i] = x * im_k[k] + y * re_k[k];
        }
        for (int j = k + 1; j < n; j++)
            eliminate(n, k, re_k, im_k, re + (ptrdiff_t)j * n, im + (ptrdiff_t)j * n);
    }
    return 0;
}

void kmp_lu_complex_solve(int n, const double *re, const double *im, const int *pivot, double *b_re, double *b_im)
{
    for (int k = 0; k < n; k++)
        if (pivot[k] != k) {
            swap(b_re, k, pivot[k]);
            swap(b_im, k, pivot[k]);
        }
    for (int k = 0; k < n; k++)
        eliminate(n, k, re + (ptrdiff_t)k * n, im + (ptrdiff_t)k * n, b_re, b_im);
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
