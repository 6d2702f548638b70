/* SPDX-License-Identifier: BSD-3-Clause */
/* The rows of a period are at equal times. Extremes of a smooth output are of polynomials through five of them. An
 * output with a corner or a jump, as the force of a contact, may have its extreme there. The rows around the sharpest
 * bends of such an output are therefore taken again, closer together, and again around the sharpest bend among these.
 */
#include "analyses/limit_cycles/cycle_extremes.h"
#include "base/arena.h"
#include "base/context.h"
#include "constraints/tolerances.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_WINDOWS = 8, LEVELS = 4 };

/* `range`: of the values; a row next to a corner or a jump counts as it is. */
static double extreme_at(int count, const double *values, ptrdiff_t stride, int at, double range)
{
    double y[5];
    for (int k = 0; k < 5; k++)
        y[k] = values[stride * ((at + k - 2 + count) % count)];
    /* The extreme value near the middle of five values at distances of 1, by Newton's method on the derivative of their
     * polynomial; the middle one where that leads away. */
    double d1 = (y[0] - 8 * y[1] + 8 * y[3] - y[4]) / 12, d2 = (-y[0] + 16 * y[1] - 30 * y[2] + 16 * y[3] - y[4]) / 12;
    double d3 = (-y[0] + 2 * y[1] - 2 * y[3] + y[4]) / 2, d4 = y[0] - 4 * y[1] + 6 * y[2] - 4 * y[3] + y[4];
    if (fabs(d4) > 6 * KMP_CYCLE_BENT * range)
        return y[2];
    double s = 0;
    for (int k = 0; k < 6; k++) {
        double bend = d2 + s * (d3 + s * d4 / 2);
        if (bend == 0)
            break;
        s -= (d1 + s * (d2 + s * (d3 / 2 + s * d4 / 6))) / bend;
    }
    return fabs(s) <= 1 ? y[2] + s * (d1 + s * (d2 / 2 + s * (d3 / 6 + s * d4 / 24))) : y[2];
}

/* The largest and the least value of a periodic quantity with `count` values at `stride`, a period without its end. */
static void find_extremes(int count, const double *values, ptrdiff_t stride, double *high, double *low)
{
    int most = 0, least = 0;
    for (int k = 1; k < count; k++) {
        most = values[stride * k] > values[stride * most] ? k : most;
        least = values[stride * k] < values[stride * least] ? k : least;
    }
    const double range = values[stride * most] - values[stride * least];
    *high = fmax(extreme_at(count, values, stride, most, range), values[stride * most]);
    *low = fmin(extreme_at(count, values, stride, least, range), values[stride * least]);
}

/* -- corners --------------------------------------------------------------------------------------------- */

/* A part of the period around a corner of an output. */
typedef struct window {
    int output;
    double from, to;
} window;

/* The bend of an output at a row, as a difference of values: at times of any distance. */
static double bend_at(const kempe_sensitivity *rows, const double *t, int row, int output)
{
    const double before = t[row] - t[row - 1], behind = t[row + 1] - t[row];
    const double here = kmp_sensitivity_value(rows, row, output);
    return fabs((kmp_sensitivity_value(rows, row + 1, output) - here) / behind -
                (here - kmp_sensitivity_value(rows, row - 1, output)) / before) *
           fmin(before, behind);
}

/* The distance of a row of equal times from the cubic polynomial through the four next to it. */
static double defect_at(const kempe_sensitivity *rows, int row, int output)
{
    static const double weight[] = {1, -4, 6, -4, 1};
    double sum = 0;
    for (int k = 0; k < 5; k++)
        sum += weight[k] * kmp_sensitivity_value(rows, row + k - 2, output);
    return fabs(sum) / 6;
}

/* Adds windows at the largest defects of an output, until they are small compared with its range. */
static int add_windows(const kempe_sensitivity *rows, const double *t, int pieces, int output, double range,
                       window *list, int count)
{
    for (const int first = count; count < MOST_WINDOWS; count++) {
        double most = KMP_CYCLE_BENT * range;
        int at = -1;
        for (int row = 2; row + 2 <= pieces; row++) {
            bool inside = false;
            for (int k = first; k < count; k++)
                inside = inside || (t[row] >= list[k].from && t[row] <= list[k].to);
            const double defect = inside ? 0 : defect_at(rows, row, output);
            if (defect > most) {
                most = defect;
                at = row;
            }
        }
        if (at < 0)
            break;
        list[count] = (window){output, t[at - 2], t[at + 2]};
    }
    return count;
}

/* -- further runs ---------------------------------------------------------------------------------------- */

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Times of a run: its start, and rows in all windows. Their number. */
static int set_times(const window *list, int count, double *t)
{
    const int each = KMP_FLOW_PIECES / count;
    int times = 1, kept = 1;
    t[0] = 0;
    for (int k = 0; k < count; k++)
        for (int i = 0; i < each; i++)
            t[times++] = list[k].from + (list[k].to - list[k].from) * i / (each - 1);
    qsort(t, (size_t)times, sizeof *t, ascending);
    for (int k = 1; k < times; k++)
        if (t[k] > t[kept - 1])
            t[kept++] = t[k];
    return kept;
}

/* A window around its sharpest bend. */
static void narrow(const kempe_sensitivity *rows, const double *t, int count, window *w)
{
    int at = -1;
    double most = -1;
    for (int row = 1; row + 1 < count; row++) {
        const double bend = t[row - 1] >= w->from && t[row + 1] <= w->to ? bend_at(rows, t, row, w->output) : -1;
        if (bend > most) {
            most = bend;
            at = row;
        }
    }
    if (at > 0) {
        w->from = t[at - 1];
        w->to = t[at + 1];
    }
}

static kempe_status look_closer(kmp_shooting *s, kmp_cycle *c, window *list, int count)
{
    const kempe_sensitivity *rows = s->flow->rows;
    for (int level = 0; level < LEVELS; level++) {
        const int times = set_times(list, count, s->flow->times);
        const kempe_status status = kmp_flow_run(s->flow, s->z, s->z[s->size + 1], times - 1);
        if (status == KEMPE_E_FAILED) { /* rows at the rounding of times */
            kmp_context_clear(s->flow->context);
            return KEMPE_OK;
        }
        KMP_TRY(status);
        for (int k = 0; k < rows->columns; k++)
            for (int row = 0; row < times && !isnan(c->high[k]); row++) {
                const double value = kmp_sensitivity_value(rows, row, k);
                c->high[k] = fmax(c->high[k], value);
                c->low[k] = fmin(c->low[k], value);
            }
        for (int k = 0; k < count; k++)
            narrow(rows, s->flow->times, times, &list[k]);
    }
    return KEMPE_OK;
}

kempe_status kmp_cycle_take_extremes(kmp_shooting *s, kmp_cycle *c)
{
    const kempe_sensitivity *rows = s->flow->rows;
    const int pieces = s->flow->pieces;
    const ptrdiff_t width = (ptrdiff_t)kmp_sensitivity_width(rows);
    window list[MOST_WINDOWS];
    int count = 0;
    for (int k = 0; k < rows->columns; k++) {
        double high, low;
        find_extremes(pieces, rows->cell + k, width, &c->high[k], &c->low[k]);
        const double change = kmp_sensitivity_value(rows, pieces, k) - kmp_sensitivity_value(rows, 0, k),
                     range = c->high[k] - c->low[k];
        if (fabs(change) > KMP_CYCLE_ADVANCES * range) {
            c->high[k] = c->low[k] = NAN;
            continue;
        }
        find_extremes(pieces / 2, rows->cell + k, 2 * width, &high, &low);
        if (fmax(fabs(high - c->high[k]), fabs(low - c->low[k])) > KMP_CYCLE_UNRESOLVED * range)
            count = add_windows(rows, s->flow->times, pieces, k, range, list, count);
    }
    return count > 0 ? look_closer(s, c, list, count) : KEMPE_OK;
}
