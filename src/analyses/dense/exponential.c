/* SPDX-License-Identifier: BSD-3-Clause */
/* Scaling and squaring (Moler and Van Loan 2003, method 3): the matrix is balanced by powers of two (Parlett and
 * Reinsch 1969), divided by a power of two until its norm is at most 1/2, where Taylor's polynomial of degree 16 leaves
 * 2^-17/17! = 2e-20, and the result is squared. */
#include "analyses/dense/exponential.h"
#include "base/memory.h"
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <string.h>

enum { DEGREE = 16, SWEEPS = 20 };

static void multiply(int n, const double *a, const double *b, double *out)
{
    memset(out, 0, (size_t)n * (size_t)n * sizeof *out);
    for (ptrdiff_t j = 0; j < n; j++)
        for (ptrdiff_t k = 0; k < n; k++)
            for (ptrdiff_t i = 0; b[k + j * n] != 0 && i < n; i++)
                out[i + j * n] += a[i + k * n] * b[k + j * n];
}

/* By what a row is divided and its column multiplied: both become equal, or, if one of them is zero, the other as
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
