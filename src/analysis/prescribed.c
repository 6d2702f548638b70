/* SPDX-License-Identifier: BSD-3-Clause */
#include "analysis/prescribed.h"
#include "base/memory.h"
#include "symbolic/table.h"
#include <math.h>
#include <string.h>

/* -- making ------------------------------------------------------------------------------------------ */

/* The rows of coordinate i that have a number. */
static int filled(int rows, int n, const double *values, int i, int *first_gap)
{
    int count = 0;
    *first_gap = -1;
    for (int r = 0; r < rows; r++) {
        bool there = isfinite(values[r * n + i]);
        count += there;
        if (!there && *first_gap < 0)
            *first_gap = r;
    }
    return count;
}

/* Whether the column is given; a column with gaps is noted. */
static bool is_given(int rows, int n, const double *values, int i, int order, kmp_gap_in_table *gap)
{
    int first_gap, count = filled(rows, n, values, i, &first_gap);
    if (count > 0 && count < rows && gap->coordinate < 0)
        *gap = (kmp_gap_in_table){i, first_gap, order};
    return count == rows;
}

/* Slopes of the spline through `from` at the rows, both columns of `count`. false: no memory. */
static bool differentiate(const kmp_prescribed *m, const double *from, double *to)
{
    double *column = KMP_NEW(double, m->rows);
    kmp_table *table = NULL;
    for (int r = 0; column && r < m->rows; r++)
        column[r] = from[r * m->count];
    if (column && m->rows > 1)
        table = kmp_table_new(KMP_TABLE_CUBIC, m->rows, m->t, column);
    for (int r = 0; r < m->rows; r++)
        to[r * m->count] = table ? kmp_table_value(table, 1, m->t[r]) : 0;
    bool ok = column && (table || m->rows < 2);
    kmp_table_free(table);
    kmp_free(column);
    return ok;
}

static bool make_room(kmp_prescribed *m, int n)
{
    m->coordinate = KMP_NEW(int, n);
    m->rate_given = KMP_NEW(bool, n);
    m->acceleration_given = KMP_NEW(bool, n);
    m->t = KMP_NEW(double, m->rows);
    m->q = KMP_NEW(double, (size_t)m->rows *(size_t)n);
    m->qd = KMP_NEW(double, (size_t)m->rows *(size_t)n);
    m->qdd = KMP_NEW(double, (size_t)m->rows *(size_t)n);
    return m->coordinate && m->rate_given && m->acceleration_given && m->t && m->q && m->qd && m->qdd;
}

/* Column i of `from` to column k, when it is given. */
static void copy_column(const kmp_prescribed *m, int n, const double *from, int i, int k, double *to)
{
    for (int r = 0; r < m->rows; r++)
        to[r * m->count + k] = from[r * n + i];
}

bool kmp_prescribed_init(kmp_prescribed *motion, int rows, const double *t, int n, const double *q, const double *qd,
                         const double *qdd, kmp_gap_in_table *gap)
{
    kmp_prescribed *m = motion;
    *m = (kmp_prescribed){.rows = rows};
    *gap = (kmp_gap_in_table){.coordinate = -1};
    bool ok = make_room(m, n);
    if (ok)
        memcpy(m->t, t, (size_t)rows * sizeof *t);
    for (int i = 0; ok && i < n; i++)
        if (is_given(rows, n, q, i, 0, gap)) {
            m->rate_given[m->count] = is_given(rows, n, qd, i, 1, gap);
            m->acceleration_given[m->count] = is_given(rows, n, qdd, i, 2, gap);
            m->coordinate[m->count++] = i;
        }
    for (int k = 0; ok && gap->coordinate < 0 && k < m->count; k++) {
        int i = m->coordinate[k];
        copy_column(m, n, q, i, k, m->q);
        if (m->rate_given[k])
            copy_column(m, n, qd, i, k, m->qd);
        else
            ok = differentiate(m, m->q + k, m->qd + k);
        if (m->acceleration_given[k])
            copy_column(m, n, qdd, i, k, m->qdd);
        else
            ok = ok && differentiate(m, m->qd + k, m->qdd + k);
    }
    if (ok && gap->coordinate < 0)
        return true;
    kmp_prescribed_free(m);
    return false;
}

void kmp_prescribed_free(kmp_prescribed *motion)
{
    kmp_free(motion->coordinate);
    kmp_free(motion->rate_given);
    kmp_free(motion->acceleration_given);
    kmp_free(motion->t);
    kmp_free(motion->q);
    kmp_free(motion->qd);
    kmp_free(motion->qdd);
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
    const double *x = m->q + row * n, *v = m->qd + row * n, *a = m->qdd + row * n;
    bool on_row = t <= m->t[row] || row == m->rows - 1;
    double h = on_row ? 1 : m->t[row + 1] - m->t[row];
    for (int k = 0; k < n; k++) {
        double at[3] = {x[k], v[k], a[k]};
        if (!on_row)
            quintic(h, (double[3]){x[k], v[k], a[k]}, (double[3]){x[k + n], v[k + n], a[k + n]}, (t - m->t[row]) / h,
                    at);
        q[k] = at[0];
        qd[k] = at[1];
        qdd[k] = at[2];
    }
}
