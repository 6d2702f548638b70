/* SPDX-License-Identifier: BSD-3-Clause */
/* Pieces in powers of the distance to their left knot. */
#include "symbolic/table.h"
#include "base/memory.h"
#include "base/spline.h"
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

static void cubic_pieces(kmp_table *t, const double *slope)
{
    for (int k = 0; k < t->count - 1; k++)
        kmp_spline_piece(t->x[k + 1] - t->x[k], t->y[k], t->y[k + 1], slope[k], slope[k + 1], t->piece[k]);
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
    kmp_spline_slopes(t->count, t->x, t->y, work, work + t->count);
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
    t->per_piece = (count - 1) / (x[count - 1] - x[0]);
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

/* The last knot but one that is not right of x, which is between the ends. */
static int find_piece(const kmp_table *t, double x)
{
    int last = t->count - 2;
    double far = (x - t->x[0]) * t->per_piece;
    int k = far < last ? (int)far : last;
    return t->x[k] <= x && (k == last || x < t->x[k + 1]) ? k : kempe_find_piece_(t->count, t->x, x);
}

double kmp_table_value(const kmp_table *t, int derivative, double x)
{
    if (x >= t->x[0] && x <= t->x[t->count - 1]) {
        int k = find_piece(t, x);
        return kempe_piece_(t->piece[k], derivative, x - t->x[k]);
    }
    return kempe_table(t->count, t->x, t->y, (const double(*)[4])t->piece, derivative, x);
}
