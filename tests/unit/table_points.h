/* SPDX-License-Identifier: BSD-3-Clause */
/* Tables with knots near and far from each other, and points on knots, beside them and anywhere, beyond the ends and
 * none. */
#ifndef KEMPE_TESTS_TABLE_POINTS_H
#define KEMPE_TESTS_TABLE_POINTS_H

#include "random.h"
#include "symbolic/table_function.h"
#include "testing.h"
#include <math.h>

enum { TABLE_POINTS = 400 };

static inline void table_points(const kmp_table *t, double x[TABLE_POINTS])
{
    for (int k = 0; k < TABLE_POINTS; k++) {
        double knot = t->x[k % t->count];
        x[k] = k < 100   ? knot
               : k < 200 ? nextafter(knot, INFINITY)
               : k < 300 ? nextafter(knot, -INFINITY)
               : k < 380 ? between(t->x[0], t->x[t->count - 1])
               : k < 399 ? between(2 * t->x[0] - t->x[t->count - 1], 2 * t->x[t->count - 1] - t->x[0])
                         : NAN;
    }
}

static inline void with_tables(void (*check)(const kmp_table *t))
{
    enum { MOST = 60 };
    random_seed(8);
    for (int round = 0; round < 40; round++) {
        double x[MOST] = {between(-1, 1)}, y[MOST] = {0};
        int count = 2 + pick(MOST - 1), wide = pick(14);
        for (int k = 1; k < count; k++) {
            x[k] = x[k - 1] + pow(10, -between(0, wide));
            y[k] = between(-1, 1);
        }
        kmp_table *t = kmp_table_new(pick(2) ? KMP_TABLE_LINEAR : KMP_TABLE_CUBIC, count, x, y);
        check(t);
        kmp_table_free(t);
    }
    const double ends[][3] = {{0, 5e-324, 1e-323}, {-1.7e308, 0, 1.7e308}, {1, 1 + 2.3e-16, 1e300}}, y[3] = {0, 0, 0};
    for (int k = 0; k < 3; k++) {
        kmp_table *t = kmp_table_new(KMP_TABLE_LINEAR, 3, ends[k], y);
        check(t);
        kmp_table_free(t);
    }
}

#endif
