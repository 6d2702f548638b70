/* SPDX-License-Identifier: BSD-3-Clause */
/* Pieces in powers of the distance to their left knot. The range is cut into equal parts, a few more than there are
 * pieces: in which one a point is never goes down where the point goes up, to the bit, so that knots of the parts
 * around bound its piece. */
#include "symbolic/table.h"
#include "base/memory.h"
#include "base/spline.h"
#include <kempe/runtime.h>
#include <math.h>
#include <string.h>

enum { PARTS = 4 }; /* a piece */

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

static int last_part(const kmp_table *t)
{
    return PARTS * (t->count - 1);
}

/* Of ranges so wide or narrow that they have no length the last one. */
static int part_of(const kmp_table *t, double x)
{
    int most = last_part(t);
    double far = (x - t->x[0]) * t->per_length;
    return far < most ? (int)far : most;
}

/* last[part + 1] of the parts; last[0] is before them. */
static void make_parts(kmp_table *t)
{
    int knot = 0;
    for (int part = 0; part <= last_part(t); part++) {
        while (knot < t->count - 2 && part_of(t, t->x[knot + 1]) <= part)
            knot++;
        t->last[part + 1] = knot;
    }
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
    t->last = KMP_NEW(int, last_part(t) + 2);
    if (!t->x || !t->y || !t->piece || !t->last) {
        kmp_table_free(t);
        return NULL;
    }
    memcpy(t->x, x, (size_t)count * sizeof *x);
    memcpy(t->y, y, (size_t)count * sizeof *y);
    t->per_length = last_part(t) / (x[count - 1] - x[0]);
    if (!make_pieces(t)) {
        kmp_table_free(t);
        return NULL;
    }
    make_parts(t);
    return t;
}

void kmp_table_free(kmp_table *t)
{
    if (!t)
        return;
    kmp_free(t->x);
    kmp_free(t->y);
    kmp_free(t->piece);
    kmp_free(t->last);
    kmp_free(t);
}

bool kmp_table_equal(const kmp_table *a, const kmp_table *b)
{
    size_t size = (size_t)a->count * sizeof(double);
    return a->method == b->method && a->count == b->count && memcmp(a->x, b->x, size) == 0 &&
           memcmp(a->y, b->y, size) == 0;
}

/* -- reading --------------------------------------------------------------------------------------- */

/* The last knot but one that is not right of x, which is between the ends. Mostly there is one knot in question. */
static inline int find_piece(const kmp_table *t, double x)
{
    const int *last = t->last + part_of(t, x);
    int low = last[0], high = last[1];
    while (high - low > 1) {
        int middle = low + (high - low) / 2;
        if (t->x[middle] <= x)
            low = middle;
        else
            high = middle;
    }
    return t->x[high] <= x ? high : low;
}

static inline double value(const kmp_table *t, int derivative, double x)
{
    if (x >= t->x[0] && x <= t->x[t->count - 1]) {
        int k = find_piece(t, x);
        return kempe_piece_(t->piece[k], derivative, x - t->x[k]);
    }
    return kempe_table(t->count, t->x, t->y, (const double(*)[4])t->piece, derivative, x);
}

double kmp_table_value(const kmp_table *t, int derivative, double x)
{
    return value(t, derivative, x);
}

void kmp_table_values(const kmp_table *t, int derivative, int n, double sign, const double *x, double *y)
{
    if (derivative == 0)
        for (int k = 0; k < n; k++)
            y[k] = value(t, 0, sign * x[k]);
    else
        for (int k = 0; k < n; k++)
            y[k] = value(t, derivative, sign * x[k]);
}
