/* SPDX-License-Identifier: BSD-3-Clause */
/* Gram-Schmidt with column pivoting, each column orthogonalised twice (Golub and Van Loan, 5.2.8, 5.4.2). */
#include "linalg/dense.h"
#include "linalg/dot.h"
#include <math.h>
#include <string.h>

static void swap_columns(int rows, double *a, int i, int k)
{
    for (int j = 0; j < rows; j++) {
        double t = a[j + i * rows];
        a[j + i * rows] = a[j + k * rows];
        a[j + k * rows] = t;
    }
}

/* The longest column from k on; ties go to the first, also with rounding. */
static int longest_column(int m, int n, const double *a, int k)
{
    double most = -1;
    int best = k;
    for (int j = k; j < n; j++) {
        double size = kmp_dot(m, a + j * m, a + j * m);
        if (size > most * (1 + 1e-12)) {
            most = size;
            best = j;
        }
    }
    return best;
}

/* target -= (q' target) q; returns q' target. */
static double take_out(int m, const double *q, double *target)
{
    double along = kmp_dot(m, q, target);
    for (int i = 0; i < m; i++)
        target[i] -= along * q[i];
    return along;
}

int kmp_qr_truncated(int m, int n, double *a, double *r, int *pivot, double eps)
{
    double first = 0;
    memset(r, 0, (size_t)(n * n) * sizeof *r);
    for (int k = 0; k < n; k++)
        pivot[k] = k;
    for (int k = 0; k < n; k++) {
        int best = longest_column(m, n, a, k), p = pivot[k];
        double *q = a + k * m;
        pivot[k] = pivot[best];
        pivot[best] = p;
        swap_columns(m, a, k, best);
        swap_columns(n, r, k, best);
        for (int j = 0; j < k; j++) /* once more against those kept */
            r[j + k * n] += take_out(m, a + j * m, q);
        double size = sqrt(kmp_dot(m, q, q));
        first = k == 0 ? size : first;
        if (!(size > eps * first))
            return k;
        r[k + k * n] = size;
        for (int i = 0; i < m; i++)
            q[i] /= size;
        for (int j = k + 1; j < n; j++)
            r[k + j * n] = take_out(m, q, a + j * m);
    }
    return n;
}
