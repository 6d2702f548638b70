/* SPDX-License-Identifier: BSD-3-Clause */
/* Pieces in powers of the distance to their left knot. The range is cut into equal parts, several times as many as
 * there are pieces. The part of a point never decreases where the point increases, to the bit, so that knots of
 * adjacent parts bound its piece. */
#include "symbolic/table_function.h"
#include "base/memory.h"
#include "base/spline.h"
#include "linalg/piece_bounds.h"
#include "symbolic/function_table.h"
#include <kempe/runtime.h>
#include <math.h>
#include <string.h>

/* Parts a piece; the number of knots from which on it is the least, for memory. */
enum { LEAST_PARTS = 8, MOST_PARTS = 64, MANY = 4000 };

static const char *const method_names[KMP_TABLE_METHODS] = {"linear", "cubic", "monotone", "periodic",
                                                            "periodic_shape"};

const char *kmp_table_method_name(kmp_table_method method)
{
    return method_names[method];
}

const char *kmp_table_method_word(kmp_table_method method)
{
    static const char *const words[KMP_TABLE_METHODS] = {"linear", "spline", "monotone", "spline", "monotone"};
    return words[method];
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

static void make_pieces(kmp_table *t)
{
    for (int k = 0; k < t->count - 1; k++) {
        t->piece[k][0] = t->y[k];
        t->piece[k][1] = (t->y[k + 1] - t->y[k]) / (t->x[k + 1] - t->x[k]);
    }
    if (t->method == KMP_TABLE_LINEAR || (t->count < 3 && t->method != KMP_TABLE_PERIODIC_SHAPE))
        return;
    double *slope = KMP_ARENA_NEW(&t->arena, double, 3 * t->count);
    if (!slope)
        return;
    if (t->method == KMP_TABLE_CUBIC)
        kmp_spline_slopes(t->count, t->x, t->y, slope, slope + t->count);
    else if (t->method == KMP_TABLE_PERIODIC)
        kmp_spline_periodic_slopes(t->count, t->x, t->y, slope);
    else
        kmp_monotone_slopes(t->count, t->x, t->y, t->method == KMP_TABLE_PERIODIC_SHAPE, slope);
    for (int k = 0; k < t->count - 1; k++)
        kmp_spline_piece(t->x[k + 1] - t->x[k], t->y[k], t->y[k + 1], slope[k], slope[k + 1], t->piece[k]);
}

/* The part of x. Ranges too wide or too narrow to have a length use the last one. */
static int part_of(const kmp_table *t, double x)
{
    int most = t->last_part;
    double far = (x - t->x[0]) * t->per_length;
    return far < most ? (int)far : most;
}

kmp_table *kmp_table_new(kmp_table_method method, int count, const double *x, const double *y)
{
    kmp_table *t = KMP_NEW(kmp_table, 1);
    if (!t)
        return NULL;
    t->method = method;
    t->count = count;
    /* Parts that are shorter than every piece have one knot at most. */
    double least = x[1] - x[0], range = x[count - 1] - x[0];
    int parts = LEAST_PARTS * (count - 1), most = count < MANY ? MOST_PARTS * (count - 1) : parts;
    for (int k = 2; k < count; k++)
        least = fmin(least, x[k] - x[k - 1]);
    while (parts < most && range > parts * least)
        parts *= 2;
    t->last_part = parts;
    t->per_length = t->last_part / (x[count - 1] - x[0]);
    KMP_ARENA_MAKE(&t->arena, KMP_ROOM(atomic_int, 1, &t->owns), KMP_ROOM(double, count, &t->x, &t->y));
    t->piece = kmp_arena_alloc(&t->arena, (size_t)count, sizeof *t->piece);
    t->knot = KMP_ARENA_NEW(&t->arena, int, MOST_PARTS *(count - 1) + 2);
    if (!t->arena.failed) {
        atomic_init(t->owns, 1);
        memcpy(t->x, x, (size_t)count * sizeof *x);
        memcpy(t->y, y, (size_t)count * sizeof *y);
        make_pieces(t);
    }
    if (t->arena.failed) {
        kmp_table_free(t);
        return NULL;
    }
    t->last_slope = kempe_piece_(t->piece[count - 2], 1, x[count - 1] - x[count - 2]);
    /* The last knot of each part. */
    t->knot[0] = 0;
    for (int part = 0, knot = 0; part <= t->last_part; part++) {
        while (knot < t->count - 2 && part_of(t, t->x[knot + 1]) <= part)
            knot++;
        t->knot[part + 1] = knot;
    }
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

/* The piece of x between the ends. */
static inline int find_piece(const kmp_table *t, double x)
{
    return kmp_table_knot(t, part_of(t, x), x);
}

double kmp_table_value_near(const kmp_table *t, int derivative, double x, int *piece)
{
    const bool inside = (unsigned)*piece < (unsigned)(t->count - 1) && t->x[*piece] <= x && x < t->x[*piece + 1];
    if (!inside) {
        if (!(x >= t->x[0] && x <= t->x[t->count - 1]))
            return kempe_interpolate(t->count, t->x, t->y, (const double(*)[4])t->piece, derivative, x);
        *piece = find_piece(t, x);
    }
    return kempe_piece_(t->piece[*piece], derivative, x - t->x[*piece]);
}

double kmp_table_value(const kmp_table *t, int derivative, double x)
{
    int none = -1;
    return kmp_table_value_near(t, derivative, x, &none);
}

/* -- bounds ---------------------------------------------------------------------------------------- */

void kmp_table_bounds(const kmp_table *t, int derivative, double from, double to, double *low, double *high)
{
    double first = t->x[0], last = t->x[t->count - 1];
    *low = INFINITY;
    *high = -INFINITY;
    kmp_include(kmp_table_value(t, derivative, from), low, high);
    kmp_include(kmp_table_value(t, derivative, to), low, high);
    from = fmax(from, first);
    to = fmin(to, last);
    for (int k = from <= to ? find_piece(t, from) : t->count; k < t->count - 1 && t->x[k] <= to; k++)
        kmp_piece_bounds(t->piece[k], derivative, fmax(from - t->x[k], 0), fmin(to, t->x[k + 1]) - t->x[k], low, high);
}

/* -- surfaces ---------------------------------------------------------------------------------------- */

/* Tables of two variables from tables of one: for each knot of the shorter variable a table that is 1 there, and a
 * table through the values along the other. Derivatives and extrapolation are the same as of tables. */

static double *copy(kmp_surface *s, int count, const double *from)
{
    double *to = KMP_ARENA_NEW(&s->arena, double, count);
    if (to)
        memcpy(to, from, (size_t)count * sizeof *to);
    return to;
}

kmp_surface *kmp_surface_new(kmp_table_method method, const int count[2], const double *x, const double *y,
                             const double *z)
{
    kmp_surface *s = KMP_NEW(kmp_surface, 1);
    if (!s)
        return NULL;
    memcpy(s->count, count, sizeof s->count);
    s->sum = count[0] < count[1] ? 0 : 1;
    s->knot[0] = copy(s, count[0], x);
    s->knot[1] = copy(s, count[1], y);
    s->z = copy(s, count[0] * count[1], z);
    s->one = KMP_ARENA_NEW(&s->arena, kmp_table *, s->count[s->sum]);
    s->through = KMP_ARENA_NEW(&s->arena, kmp_table *, s->count[s->sum]);
    double *work = KMP_ARENA_NEW(&s->arena, double, count[0] + count[1]);
    bool good = !s->arena.failed;
    for (int j = 0; good && j < s->count[s->sum]; j++) {
        /* The tables of knot j of the sum; `y`: room for as many values as there are knots of either variable. */
        int sum = s->sum, other = 1 - sum, n = s->count[other];
        for (int k = 0; k < s->count[sum]; k++)
            work[k] = k == j;
        s->one[j] = kmp_table_new(method, s->count[sum], s->knot[sum], work);
        for (int i = 0; i < n; i++)
            work[i] = s->z[sum == 1 ? i * s->count[1] + j : j * s->count[1] + i];
        s->through[j] = kmp_table_new(method, n, s->knot[other], work);
        good = s->one[j] && s->through[j];
    }
    if (good)
        return s;
    kmp_surface_free(s);
    return NULL;
}

void kmp_surface_free(kmp_surface *s)
{
    if (!s)
        return;
    for (int j = 0; s->one && s->through && j < s->count[s->sum]; j++) {
        kmp_table_free(s->one[j]);
        kmp_table_free(s->through[j]);
    }
    kmp_arena_free(&s->arena);
    kmp_free(s);
}

double kmp_surface_value(const kmp_surface *s, double x, double y)
{
    double at[2] = {x, y}, sum = 0;
    for (int j = 0; j < s->count[s->sum]; j++)
        sum += kmp_table_value(s->one[j], 0, at[s->sum]) * kmp_table_value(s->through[j], 0, at[1 - s->sum]);
    return sum;
}

/* True for the table of zeros. */
static bool is_zero(const kmp_table *table)
{
    for (int k = 0; k < table->count; k++)
        if (table->y[k] != 0)
            return false;
    return true;
}

kmp_ref(kmp_surface_at)(kmp_graph *g, const kmp_surface *s, kmp_ref x, kmp_ref y)
{
    kmp_ref at[2] = {x, y}, sum = KMP_ZERO;
    for (int j = 0; j < s->count[s->sum]; j++) {
        if (is_zero(s->through[j]))
            continue;
        kmp_ref c = kmp_table_at(g, kmp_graph_add_table(g, s->one[j]), at[s->sum]);
        sum = kmp_add(g, sum, kmp_mul(g, c, kmp_table_at(g, kmp_graph_add_table(g, s->through[j]), at[1 - s->sum])));
    }
    return sum;
}
