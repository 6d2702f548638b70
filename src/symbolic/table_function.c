/* SPDX-License-Identifier: BSD-3-Clause */
/* Pieces in powers of the distance to their left knot. The range is cut into equal parts, several times as many as
 * there are pieces. The part of a point never decreases where the point increases, to the bit, so that knots of
 * adjacent parts bound its piece. */
#include "symbolic/table_function.h"
#include "base/clones.h"
#include "base/memory.h"
#include "base/simd4.h"
#include "base/spline.h"
#include <kempe/runtime.h>
#include <math.h>
#include <string.h>

enum { PARTS = 8 }; /* a piece */

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

/* -- construction ---------------------------------------------------------------------------------- */

static double secant(const kmp_table *t, int k)
{
    return (t->y[k + 1] - t->y[k]) / (t->x[k + 1] - t->x[k]);
}

static void make_pieces(kmp_table *t)
{
    for (int k = 0; k < t->count - 1; k++) {
        t->piece[k][0] = t->y[k];
        t->piece[k][1] = secant(t, k);
    }
    if (t->method == KMP_TABLE_LINEAR || t->count < 3)
        return;
    double *slope = KMP_ARENA_NEW(&t->arena, double, 3 * t->count);
    if (!slope)
        return;
    kmp_spline_slopes(t->count, t->x, t->y, slope, slope + t->count);
    for (int k = 0; k < t->count - 1; k++)
        kmp_spline_piece(t->x[k + 1] - t->x[k], t->y[k], t->y[k + 1], slope[k], slope[k + 1], t->piece[k]);
}

static int last_part(const kmp_table *t)
{
    return PARTS * (t->count - 1);
}

/* The part of x. Ranges too wide or too narrow to have a length use the last one. */
static int part_of(const kmp_table *t, double x)
{
    int most = last_part(t);
    double far = (x - t->x[0]) * t->per_length;
    return far < most ? (int)far : most;
}

static void make_parts(kmp_table *t)
{
    for (int part = 0, before = 0, knot = 0; part <= last_part(t); part++, before = knot) {
        while (knot < t->count - 2 && part_of(t, t->x[knot + 1]) <= part)
            knot++;
        t->part[part] = (kmp_table_part){t->x[knot], before, knot - before};
    }
}

kmp_table *kmp_table_new(kmp_table_method method, int count, const double *x, const double *y)
{
    kmp_table *t = KMP_NEW(kmp_table, 1);
    if (!t)
        return NULL;
    t->method = method;
    t->count = count;
    KMP_ARENA_MAKE(&t->arena, KMP_ROOM(atomic_int, 1, &t->owns), KMP_ROOM(double, count, &t->x, &t->y));
    t->piece = kmp_arena_alloc(&t->arena, (size_t)count, sizeof *t->piece);
    t->part = KMP_ARENA_NEW(&t->arena, kmp_table_part, last_part(t) + 1);
    if (!t->arena.failed) {
        atomic_init(t->owns, 1);
        memcpy(t->x, x, (size_t)count * sizeof *x);
        memcpy(t->y, y, (size_t)count * sizeof *y);
        t->per_length = last_part(t) / (x[count - 1] - x[0]);
        make_pieces(t);
    }
    if (t->arena.failed) {
        kmp_table_free(t);
        return NULL;
    }
    t->last_slope = kempe_piece_(t->piece[count - 2], 1, x[count - 1] - x[count - 2]);
    make_parts(t);
    return t;
}

void kmp_table_free(kmp_table *t)
{
    if (!t || (t->owns && atomic_fetch_sub(t->owns, 1) > 1))
        return;
    kmp_arena_free(&t->arena);
    kmp_free(t);
}

kmp_table *kmp_table_share(kmp_table *t)
{
    (void)atomic_fetch_add(t->owns, 1);
    return t;
}

bool kmp_table_equal(const kmp_table *a, const kmp_table *b)
{
    return a == b || kmp_table_is_of(a, b->method, b->count, b->x, b->y);
}

bool kmp_table_is_of(const kmp_table *table, kmp_table_method method, int count, const double *x, const double *y)
{
    size_t size = (size_t)count * sizeof(double);
    return table->method == method && table->count == count && memcmp(table->x, x, size) == 0 &&
           memcmp(table->y, y, size) == 0;
}

/* -- reading --------------------------------------------------------------------------------------- */

/* The last knot but one that is not right of x, of those of a part. Mostly one knot is tested. */
static inline int find_knot(const kmp_table *t, const kmp_table_part *part, double x)
{
    int low = part->knot, high = low + part->more;
    while (high - low > 1) {
        int middle = low + (high - low) / 2;
        if (t->x[middle] <= x)
            low = middle;
        else
            high = middle;
    }
    return t->x[high] <= x ? high : low;
}

/* The same for x between the ends. */
static inline int find_piece(const kmp_table *t, double x)
{
    return find_knot(t, t->part + part_of(t, x), x);
}

double kmp_table_value(const kmp_table *t, int derivative, double x)
{
    if (x >= t->x[0] && x <= t->x[t->count - 1]) {
        int k = find_piece(t, x);
        return kempe_piece_(t->piece[k], derivative, x - t->x[k]);
    }
    return kempe_interpolate(t->count, t->x, t->y, (const double(*)[4])t->piece, derivative, x);
}

/* -- bounds ---------------------------------------------------------------------------------------- */

static void include(double x, double *low, double *high)
{
    *low = fmin(*low, x);
    *high = fmax(*high, x);
}

/* The control values of a piece's derivative between two places, within which it stays (Bernstein). */
static void include_piece(const double piece[4], int derivative, double from, double to, double *low, double *high)
{
    double w = to - from, d[4];
    static const double factorial[4] = {1, 1, 2, 6};
    for (int k = 0; k < 4; k++)
        d[k] = kempe_piece_(piece, derivative + k, from) * pow(w, k) / factorial[k];
    include(d[0], low, high);
    include(d[0] + d[1] / 3, low, high);
    include(d[0] + (2 * d[1] + d[2]) / 3, low, high);
    include(d[0] + d[1] + d[2] + d[3], low, high);
}

void kmp_table_bounds(const kmp_table *t, int derivative, double from, double to, double *low, double *high)
{
    double first = t->x[0], last = t->x[t->count - 1];
    *low = INFINITY;
    *high = -INFINITY;
    include(kmp_table_value(t, derivative, from), low, high);
    include(kmp_table_value(t, derivative, to), low, high);
    from = fmax(from, first);
    to = fmin(to, last);
    for (int k = from <= to ? find_piece(t, from) : t->count; k < t->count - 1 && t->x[k] <= to; k++)
        include_piece(t->piece[k], derivative, fmax(from - t->x[k], 0), fmin(to, t->x[k + 1]) - t->x[k], low, high);
}

/* Finds pieces; beyond the ends and for NaN any piece will do. Several candidate knots are bisected. */
KMP_CLONES static void find(const kmp_table *t, int n, double sign, const double *x, int *piece)
{
    const double first = t->x[0], most = last_part(t), scale = t->per_length;
    const kmp_table_part *parts = t->part;
    for (int k = 0; k < n; k += KMP_FOUR) {
        const kmp_four at = sign * KMP_FOUR_CONST(x + k), far = (at - first) * scale;
        const kmp_four low = KMP_FOUR_SELECT(far >= 0, far, (kmp_four){0});
        const kmp_four part = KMP_FOUR_SELECT(low < most, low, KMP_FOUR_ALL(most));
        int knots = 0;
#pragma GCC unroll 4
        for (int l = 0; l < KMP_FOUR; l++) { /* without jumps, which nothing would predict */
            const kmp_table_part *in = parts + (int)part[l];
            piece[k + l] = in->knot + (-(in->last <= at[l]) & in->more);
            knots |= in->more;
        }
        for (int l = 0; knots > 1 && l < KMP_FOUR; l++)
            piece[k + l] = find_knot(t, parts + (int)part[l], at[l]);
    }
}

/* Values in four pieces; `derivative` is a compile-time constant, here and below. */
static KMP_INTO_CLONES void within(const kmp_table *t, int derivative, const kmp_four *at, const int *p, kmp_four *y)
{
    const double *c[KMP_FOUR] = {t->piece[p[0]], t->piece[p[1]], t->piece[p[2]], t->piece[p[3]]};
    const kmp_four s = *at - (kmp_four){t->x[p[0]], t->x[p[1]], t->x[p[2]], t->x[p[3]]};
    const kmp_four c0 = {c[0][0], c[1][0], c[2][0], c[3][0]}, c1 = {c[0][1], c[1][1], c[2][1], c[3][1]};
    const kmp_four c2 = {c[0][2], c[1][2], c[2][2], c[3][2]}, c3 = {c[0][3], c[1][3], c[2][3], c[3][3]};
    if (derivative == 0)
        *y = c0 + s * (c1 + s * (c2 + s * c3));
    else if (derivative == 1)
        *y = c1 + s * (2 * c2 + s * (3 * c3));
    else if (derivative == 2)
        *y = 2 * c2 + s * (6 * c3);
    else if (derivative == 3)
        *y = 6 * c3;
    else
        *y = KMP_FOUR_ALL(0.0);
}

/* Straight on from an end. */
static KMP_INTO_CLONES void beyond(const kmp_table *t, int derivative, int end, double slope, const kmp_four *at,
                                   kmp_four *y)
{
    if (derivative == 0)
        *y = t->y[end] + slope * (*at - t->x[end]);
    else
        *y = KMP_FOUR_ALL(derivative == 1 ? slope : 0.0);
}

static KMP_INTO_CLONES void look_up(const kmp_table *t, int derivative, int n, double sign, const double *x,
                                    const int *piece, double *y)
{
    for (int k = 0, last = t->count - 1; k < n; k += KMP_FOUR) {
        const kmp_four at = sign * KMP_FOUR_CONST(x + k);
        kmp_four here, before, behind;
        within(t, derivative, &at, piece + k, &here);
        beyond(t, derivative, 0, t->piece[0][1], &at, &before);
        beyond(t, derivative, last, t->last_slope, &at, &behind);
        here = KMP_FOUR_SELECT(at < t->x[0], before, here);
        here = KMP_FOUR_SELECT(at > t->x[last], behind, here);
        KMP_FOUR_AT(y + k) = KMP_FOUR_SELECT(at == at, here, at);
    }
}

KMP_CLONES static void look_up_all(const kmp_table *t, int derivative, int n, double sign, const double *x,
                                   const int *piece, double *y)
{
    if (derivative == 0)
        look_up(t, 0, n, sign, x, piece, y);
    else if (derivative == 1)
        look_up(t, 1, n, sign, x, piece, y);
    else if (derivative == 2)
        look_up(t, 2, n, sign, x, piece, y);
    else if (derivative == 3)
        look_up(t, 3, n, sign, x, piece, y);
    else
        look_up(t, 4, n, sign, x, piece, y);
}

/* Clones that are not static would be seen outside of a shared library. */
void kmp_table_find(const kmp_table *table, int n, double sign, const double *x, int *piece)
{
    find(table, n, sign, x, piece);
}

void kmp_table_values(const kmp_table *table, int derivative, int n, double sign, const double *x, const int *piece,
                      double *y)
{
    look_up_all(table, derivative, n, sign, x, piece, y);
}
