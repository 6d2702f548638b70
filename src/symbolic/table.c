/* SPDX-License-Identifier: BSD-3-Clause */
/* Pieces in powers of the distance to their left knot. The slopes of the spline come from one tridiagonal system
 * (de Boor, A Practical Guide to Splines, 1978, chapter IV), which needs no exchange of rows. */
#include "symbolic/table.h"
#include "base/memory.h"
#include <kempe/runtime.h>
#include <math.h>
#include <string.h>

static const char *const method_names[KMP_TABLE_METHODS] = {"linear", "cubic"};

const char *kmp_table_method_name(kmp_table_method method)
{
    return method_names[method];
}

int kmp_table_degree(const kmp_table *table)
{
    return table->method == KMP_TABLE_LINEAR ? 1 : 3;
}

int kmp_table_check(int count, const double *x, const double *y)
{
    if (count < 2)
        return count < 0 ? 0 : count;
    for (int k = 0; k < count; k++)
        if (!isfinite(x[k]) || !isfinite(y[k]) || (k > 0 && x[k] <= x[k - 1]))
            return k;
    return -1;
}

/* -- making ---------------------------------------------------------------------------------------- */

static double secant(const kmp_table *t, int k)
{
    return (t->y[k + 1] - t->y[k]) / (t->x[k + 1] - t->x[k]);
}

/* The end that begins with steps h, g and secants m, n: (g, h + g) slopes = *right. */
static double end_row(double h, double g, double m, double n)
{
    double d = h + g;
    return ((h + 2 * d) * g * m + h * h * n) / d;
}

/* Slopes at the knots of four or more; `pivot` and `upper` are room for the elimination. */
static void spline_slopes(const kmp_table *t, double *slope, double *pivot, double *upper)
{
    int n = t->count;
    const double *x = t->x;
    pivot[0] = x[2] - x[1];
    upper[0] = x[2] - x[0];
    slope[0] = end_row(x[1] - x[0], x[2] - x[1], secant(t, 0), secant(t, 1));
    for (int k = 1; k < n; k++) {
        double lower, h = x[k] - x[k - 1];
        if (k < n - 1) {
            double g = x[k + 1] - x[k];
            lower = g;
            pivot[k] = 2 * (h + g);
            upper[k] = h;
            slope[k] = 3 * (g * secant(t, k - 1) + h * secant(t, k));
        } else {
            double g = x[k - 1] - x[k - 2];
            lower = h + g;
            pivot[k] = g;
            slope[k] = end_row(h, g, secant(t, k - 1), secant(t, k - 2));
        }
        double factor = lower / pivot[k - 1];
        pivot[k] -= factor * upper[k - 1];
        slope[k] -= factor * slope[k - 1];
    }
    slope[n - 1] /= pivot[n - 1];
    for (int k = n - 2; k >= 0; k--)
        slope[k] = (slope[k] - upper[k] * slope[k + 1]) / pivot[k];
}

/* The parabola through three points. */
static void parabola_slopes(const kmp_table *t, double *slope)
{
    double h = t->x[1] - t->x[0], g = t->x[2] - t->x[1], m = secant(t, 0), n = secant(t, 1);
    double bend = (n - m) / (h + g);
    slope[0] = m - h * bend;
    slope[1] = m + h * bend;
    slope[2] = n + g * bend;
}

static void cubic_pieces(kmp_table *t, const double *slope)
{
    for (int k = 0; k < t->count - 1; k++) {
        double h = t->x[k + 1] - t->x[k], m = secant(t, k), bend = (slope[k] + slope[k + 1] - 2 * m) / h;
        t->piece[k][1] = slope[k];
        t->piece[k][2] = (m - slope[k]) / h - bend;
        t->piece[k][3] = bend / h;
    }
}

static bool make_pieces(kmp_table *t)
{
    for (int k = 0; k < t->count - 1; k++) {
        t->piece[k][0] = t->y[k];
        t->piece[k][1] = secant(t, k);
    }
    if (t->method == KMP_TABLE_LINEAR || t->count < 3)
        return true;
    double *work = KMP_NEW(double, 3 * t->count);
    if (!work)
        return false;
    if (t->count == 3)
        parabola_slopes(t, work);
    else
        spline_slopes(t, work, work + t->count, work + 2 * t->count);
    cubic_pieces(t, work);
    kmp_free(work);
    return true;
}

kmp_table *kmp_table_new(kmp_table_method method, int count, const double *x, const double *y)
{
    kmp_table *t = KMP_NEW(kmp_table, 1);
    if (!t)
        return NULL;
    t->method = method;
    t->count = count;
    t->x = KMP_NEW(double, count);
    t->y = KMP_NEW(double, count);
    t->piece = kmp_calloc((size_t)count, sizeof *t->piece);
    if (!t->x || !t->y || !t->piece) {
        kmp_table_free(t);
        return NULL;
    }
    memcpy(t->x, x, (size_t)count * sizeof *x);
    memcpy(t->y, y, (size_t)count * sizeof *y);
    if (!make_pieces(t)) {
        kmp_table_free(t);
        return NULL;
    }
    return t;
}

void kmp_table_free(kmp_table *t)
{
    if (!t)
        return;
    kmp_free(t->x);
    kmp_free(t->y);
    kmp_free(t->piece);
    kmp_free(t);
}

bool kmp_table_equal(const kmp_table *a, const kmp_table *b)
{
    size_t size = (size_t)a->count * sizeof(double);
    return a->method == b->method && a->count == b->count && memcmp(a->x, b->x, size) == 0 &&
           memcmp(a->y, b->y, size) == 0;
}

/* -- reading --------------------------------------------------------------------------------------- */

double kmp_table_value(const kmp_table *t, int derivative, double x)
{
    return kempe_table(t->count, t->x, t->y, (const double(*)[4])t->piece, derivative, x);
}
