/* SPDX-License-Identifier: BSD-3-Clause */
#include "studies/inverse/prescribed.h"
#include "base/memory.h"
#include "base/spline.h"
#include <math.h>
#include <string.h>

/* -- construction ------------------------------------------------------------------------------------ */

/* True if the column is given; a column with missing values is noted. */
static bool is_given(int rows, int n, const double *values, int i, int order, kmp_gap_in_table *gap)
{
    int count = 0, first_gap = -1;
    for (int r = 0; r < rows; r++) {
        bool there = isfinite(values[r * n + i]);
        count += there;
        if (!there && first_gap < 0)
            first_gap = r;
    }
    if (count > 0 && count < rows && gap->coordinate < 0)
        *gap = (kmp_gap_in_table){i, first_gap, order};
    return count == rows;
}

static bool make_room(kmp_prescribed *m, int n)
{
    m->coordinate = KMP_ARENA_NEW(&m->arena, int, n);
    m->t = KMP_ARENA_NEW(&m->arena, double, m->rows);
    for (int order = 0; order < 3; order++) {
        m->value[order] = KMP_ARENA_NEW(&m->arena, double, (size_t)m->rows *(size_t)n);
        m->given[order] = KMP_ARENA_NEW(&m->arena, bool, n);
    }
    return !m->arena.failed;
}

/* Column k of an order: column i of n that are given, or the derivatives at the rows of the spline through the column
 * of the order before. room: 4 numbers per row. */
static void put_column(kmp_prescribed *m, int order, int k, int n, const double *given, int i, double *room)
{
    int rows = m->rows;
    double *column = room, *slope = column + rows, *to = m->value[order] + k;
    for (int r = 0; r < rows; r++)
        slope[r] = m->given[order][k] ? given[r * n + i] : 0;
    for (int r = 0; order > 0 && r < rows; r++)
        column[r] = m->value[order - 1][r * m->count + k];
    if (!m->given[order][k] && rows > 1)
        kmp_spline_slopes(rows, m->t, column, slope, slope + rows);
    for (int r = 0; r < rows; r++)
        to[r * m->count] = slope[r];
}

bool kmp_prescribed_init(kmp_prescribed *motion, int rows, const double *t, int n, const double *q, const double *qd,
                         const double *qdd, kmp_gap_in_table *gap)
{
    const double *from[] = {q, qd, qdd};
    kmp_prescribed *m = motion;
    *m = (kmp_prescribed){.rows = rows};
    *gap = (kmp_gap_in_table){.coordinate = -1};
    double *room = KMP_NEW(double, 4 * (size_t)rows);
    bool ok = make_room(m, n) && room;
    if (ok)
        memcpy(m->t, t, (size_t)rows * sizeof *t);
    for (int i = 0; ok && i < n; i++)
        if (is_given(rows, n, q, i, 0, gap)) {
            for (int order = 0; order < 3; order++)
                m->given[order][m->count] = is_given(rows, n, from[order], i, order, gap);
            m->coordinate[m->count++] = i;
        }
    ok = ok && gap->coordinate < 0;
    for (int k = 0; ok && k < m->count; k++)
        for (int order = 0; order < 3; order++)
            put_column(m, order, k, n, from[order], m->coordinate[k], room);
    kmp_free(room);
    if (!ok)
        kmp_prescribed_free(m);
    return ok;
}

void kmp_prescribed_free(kmp_prescribed *motion)
{
    kmp_arena_free(&motion->arena);
    *motion = (kmp_prescribed){0};
}

/* -- between the rows -------------------------------------------------------------------------------- */

/* The last row at or before t. */
static int row_before(const kmp_prescribed *m, double t)
{
    int low = 0, high = m->rows;
    while (high - low > 1) {
        int middle = (low + high) / 2;
        if (m->t[middle] <= t)
            low = middle;
        else
            high = middle;
    }
    return low;
}

/* The quintic from (q, v, a) at 0 to those at h, with its derivatives at s h. */
static void quintic(double h, const double from[3], const double to[3], double s, double out[3])
{
    double v = h * from[1], a = h * h * from[2];
    double d = to[0] - from[0] - v - a / 2, dv = h * to[1] - v - a, da = h * h * to[2] - a;
    double c3 = 10 * d - 4 * dv + da / 2, c4 = -15 * d + 7 * dv - da, c5 = 6 * d - 3 * dv + da / 2;
    out[0] = from[0] + s * (v + s * (a / 2 + s * (c3 + s * (c4 + s * c5))));
    out[1] = (v + s * (a + s * (3 * c3 + s * (4 * c4 + s * 5 * c5)))) / h;
    out[2] = (a + s * (6 * c3 + s * (12 * c4 + s * 20 * c5))) / (h * h);
}

void kmp_prescribed_at(const kmp_prescribed *motion, double t, double *q, double *qd, double *qdd)
{
    const kmp_prescribed *m = motion;
    int row = row_before(m, t), n = m->count;
    const double *x = m->value[0] + row * n, *v = m->value[1] + row * n, *a = m->value[2] + row * n;
    bool on_row = t <= m->t[row] || row == m->rows - 1;
    double h = on_row ? 1 : m->t[row + 1] - m->t[row];
    for (int k = 0; k < n; k++) {
        const double from[] = {x[k], v[k], a[k]};
        double at[] = {x[k], v[k], a[k]};
        if (!on_row)
            quintic(h, from, (double[]){x[k + n], v[k + n], a[k + n]}, (t - m->t[row]) / h, at);
        q[m->coordinate[k]] = at[0];
        qd[m->coordinate[k]] = at[1];
        qdd[m->coordinate[k]] = at[2];
    }
}
