/* SPDX-License-Identifier: BSD-3-Clause */
#include "analyses/parts/series_summary.h"
#include <math.h>
#include <stdbool.h>
#include <stddef.h>

/* Integrals over the range, and the part of it without values. */
typedef struct sums {
    double first, last, gaps, values, squares;
    double before; /* value of the last row, NaN: unknown */
} sums;

static void add(sums *s, double x, double y)
{
    double h = x - s->last;
    if (isfinite(s->before) && isfinite(y)) {
        s->values += h / 2 * (y + s->before);
        s->squares += h / 2 * (y * y + s->before * s->before);
    } else {
        s->gaps += h;
    }
    s->last = x;
    s->before = y;
}

static void reach(kmp_series_summary *all, double x, double y)
{
    if (!isfinite(y))
        return;
    if (!(y >= all->low)) {
        all->low = y;
        all->low_at = x;
    }
    if (!(y <= all->high)) {
        all->high = y;
        all->high_at = x;
    }
}

kmp_series_summary kmp_series_summarise(int rows, const double *x, const double *y, int stride)
{
    kmp_series_summary all = {NAN, NAN, NAN, NAN, NAN, NAN};
    sums s = {0};
    for (int k = 0; k < rows; k++) {
        double value = y[(ptrdiff_t)k * stride];
        reach(&all, x[k], value);
        if (k == 0)
            s = (sums){.first = x[k], .last = x[k], .before = value};
        else
            add(&s, x[k], value);
    }
    double length = s.last - s.first - s.gaps;
    bool any = length != 0;
    all.mean = any ? s.values / length : all.high;
    all.rms = any ? sqrt(s.squares / length) : fabs(all.high);
    return all;
}
