/* SPDX-License-Identifier: BSD-3-Clause */
/* Tables of two variables from tables of one: for each knot of the shorter variable a table that is 1 there, and a
 * table through the values along the other. Derivatives and extrapolation are those of tables. */
#include "symbolic/surface.h"
#include "base/memory.h"
#include "symbolic/function_table.h"
#include <string.h>

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
