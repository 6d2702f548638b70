/* SPDX-License-Identifier: BSD-3-Clause */
/* A congruence, complete pivoting only for pivots, and counts of operations. Loops run down columns, as compilers
 * vectorise them. */
#include "linalg/dense/dense.h"
#include <math.h>
#include <stddef.h>

void kmp_cholesky_congruence(int n, const double *l, double *a)
{
    for (int pass = 0; pass < 2; pass++) {
        for (int k = 0; k < n; k++)
            kmp_cholesky_forward(n, l, a + (ptrdiff_t)n * k);
        for (int i = 0; i < n; i++)
            for (int j = 0; j < i; j++) {
                const double kept = a[i + n * j];
                a[i + n * j] = a[j + n * i];
                a[j + n * i] = kept;
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

/* -- only pivots -------------------------------------------------------------------------------------- */

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
