/* SPDX-License-Identifier: BSD-3-Clause */
/* Complex LU with partial pivoting, complete pivoting for pivots alone, and counts of operations. Loops run down
 * columns, as compilers vectorise them. */
#include "linalg/dense/dense.h"
#include "base/memory.h"
#include <complex.h>
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <string.h>

/* -- complex LU ------------------------------------------------------------------------------------- */

/* Pivots are chosen by the sum of absolute values; each is kept as its reciprocal. */
static double size_of(double complex x)
{
    return fabs(creal(x)) + fabs(cimag(x));
}

/* The compiler's own product looks at infinities one by one. */
static inline double complex times(double complex x, double complex y)
{
    return KMP_COMPLEX(creal(x) * creal(y) - cimag(x) * cimag(y), creal(x) * cimag(y) + cimag(x) * creal(y));
}

/* 1 / x in place, without overflow or underflow. False: zero or not finite. */
static bool invert(double complex *x)
{
    double scale = fmax(fabs(creal(*x)), fabs(cimag(*x)));
    if (!(scale > 0.0 && size_of(*x) <= DBL_MAX))
        return false;
    double re = creal(*x) / scale, im = cimag(*x) / scale, square = re * re + im * im;
    *x = KMP_COMPLEX(re / square / scale, -im / square / scale);
    return true;
}

/* column -= l times its entry k, below row k */
static void eliminate_complex(int n, int k, const double complex *l, double complex *restrict column)
{
    for (int i = k + 1; i < n; i++)
        column[i] -= times(l[i], column[k]);
}

static void exchange_complex(double complex *a, double complex *b)
{
    double complex t = *a;
    *a = *b;
    *b = t;
}

int kmp_lu_complex_factor(int n, double complex *a, int *pivot)
{
    for (int k = 0; k < n; k++) {
        double complex *l = a + (ptrdiff_t)k * n;
        int p = k;
        for (int i = k + 1; i < n; i++)
            p = size_of(l[i]) > size_of(l[p]) ? i : p;
        pivot[k] = p;
        for (int j = 0; j < n && p != k; j++)
            exchange_complex(&a[k + (ptrdiff_t)j * n], &a[p + (ptrdiff_t)j * n]);
        if (!invert(&l[k]))
            return k + 1;
        for (int i = k + 1; i < n; i++)
            l[i] = times(l[i], l[k]);
        for (int j = k + 1; j < n; j++)
            eliminate_complex(n, k, l, a + (ptrdiff_t)j * n);
    }
    return 0;
}

void kmp_lu_complex_solve(int n, const double complex *a, const int *pivot, double complex *b)
{
    for (int k = 0; k < n; k++)
        if (pivot[k] != k)
            exchange_complex(&b[k], &b[pivot[k]]);
    for (int k = 0; k < n; k++)
        eliminate_complex(n, k, a + (ptrdiff_t)k * n, b);
    for (int k = n - 1; k >= 0; k--) {
        const double complex *u = a + (ptrdiff_t)k * n;
        b[k] = times(b[k], u[k]);
        for (int i = 0; i < k; i++)
            b[i] -= times(u[i], b[k]);
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

/* -- exponentials ------------------------------------------------------------------------------------ */

/* Scaling and squaring (Moler and Van Loan 2003, method 3): the matrix is balanced by powers of two (Parlett and
 * Reinsch 1969), divided by a power of two until its norm is at most 1/2, where Taylor's polynomial of degree 16 leaves
 * 2^-17/17! = 2e-20, and the result is squared. */

enum { DEGREE = 16, SWEEPS = 20 };

static void multiply(int n, const double *a, const double *b, double *out)
{
    memset(out, 0, (size_t)n * (size_t)n * sizeof *out);
    for (ptrdiff_t j = 0; j < n; j++)
        for (ptrdiff_t k = 0; k < n; k++)
            for (ptrdiff_t i = 0; b[k + j * n] != 0 && i < n; i++)
                out[i + j * n] += a[i + k * n] * b[k + j * n];
}

/* By what a row is divided and its column multiplied: both become equal, or where one of them is zero the other as
 * small as the diagonal. */
static double factor_of(double row, double column, double size)
{
    if (row > 0 && column > 0)
        return exp2(round(0.5 * log2(row / column)));
    double other = fmax(row, column) / size;
    return other <= 1 ? 1 : exp2(column > 0 ? -ceil(log2(other)) : ceil(log2(other)));
}

static void balance(int n, double *a, double *factors)
{
    bool changed = true;
    double size = 0;
    for (ptrdiff_t i = 0; i < n; i++)
        size = fmax(size, fabs(a[i + i * n]));
    size = size > 0 ? size : 1;
    for (int i = 0; i < n; i++)
        factors[i] = 1;
    for (int sweep = 0; sweep < SWEEPS && changed; sweep++) {
        changed = false;
        for (int i = 0; i < n; i++) {
            double row = 0, column = 0; /* sums of moduli without the diagonal */
            for (ptrdiff_t k = 0; k < n; k++) {
                row += k == i ? 0 : fabs(a[i + k * n]);
                column += k == i ? 0 : fabs(a[k + (ptrdiff_t)i * n]);
            }
            double factor = factor_of(row, column, size);
            changed = changed || factor != 1;
            factors[i] *= factor;
            /* Divides row i by a factor and multiplies column i by it. */
            for (ptrdiff_t k = 0; k < n; k++)
                a[i + k * n] /= factor;
            for (ptrdiff_t k = 0; k < n; k++)
                a[k + (ptrdiff_t)i * n] *= factor;
        }
    }
}

int kmp_exponential(int n, const double *a, double h, double *e)
{
    size_t size = (size_t)n * (size_t)n;
    double *scaled = KMP_NEW(double, 2 * size + (size_t)n);
    int squarings = 0;
    if (!scaled)
        return -1;
    double *work = scaled + size, *factors = work + size;
    for (size_t i = 0; i < size; i++)
        scaled[i] = a[i] * h;
    balance(n, scaled, factors);
    double norm = 0;
    for (ptrdiff_t j = 0; j < n; j++) {
        double sum = 0;
        for (ptrdiff_t i = 0; i < n; i++)
            sum += fabs(scaled[i + j * n]);
        norm = fmax(norm, isfinite(sum) ? sum : INFINITY);
    }
    if (!isfinite(norm)) {
        kmp_free(scaled);
        return -1;
    }
    while (ldexp(norm, -squarings) > 0.5)
        squarings++;
    for (size_t i = 0; i < size; i++)
        scaled[i] = ldexp(scaled[i], -squarings);
    /* e = 1 + a (1 + a/2 (1 + ..)). */
    memset(e, 0, size * sizeof *e);
    for (ptrdiff_t i = 0; i < n; i++)
        e[i + i * n] = 1;
    for (int k = DEGREE; k > 0; k--) {
        multiply(n, scaled, e, work);
        for (size_t i = 0; i < size; i++)
            e[i] = work[i] / k;
        for (ptrdiff_t i = 0; i < n; i++)
            e[i + i * n] += 1;
    }
    for (int k = 0; k < squarings; k++) {
        multiply(n, e, e, work);
        memcpy(e, work, size * sizeof *e);
    }
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++)
            e[i + j * n] *= factors[i] / factors[j];
    kmp_free(scaled);
    return 0;
}
