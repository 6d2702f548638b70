/* SPDX-License-Identifier: BSD-3-Clause */
/* A parallel curve as a spline through places on normals of the profile; it fails where the curve would turn back, at
 * the inside of a curvature that is too narrow. */
#include "model/data/parallel_curve.h"
#include "base/memory.h"
#include <math.h>

/* Places for each piece: the spline between them differs from the curve by the fourth power of their spacing. */
enum { PER_PIECE = 16 };

/* Place k of the curve; false: it lies behind the one before it. */
static bool put_place(const kmp_table *table, double distance, int k, double *x, double *y)
{
    int piece = k / PER_PIECE < table->count - 1 ? k / PER_PIECE : table->count - 2;
    double part = (k - piece * PER_PIECE) / (double)PER_PIECE;
    double at = table->x[piece] + part * (table->x[piece + 1] - table->x[piece]);
    double slope = kmp_table_value(table, 1, at), size = sqrt(1 + slope * slope);
    x[k] = at - distance * slope / size;
    y[k] = kmp_table_value(table, 0, at) + distance / size;
    return k == 0 || x[k] > x[k - 1];
}

kmp_table *kmp_parallel_curve(kmp_table *table, double distance, bool *folds)
{
    int count = (table->count - 1) * PER_PIECE + 1;
    *folds = false;
    if (distance == 0)
        return kmp_table_share(table);
    double *x = KMP_NEW(double, 2 * count);
    for (int k = 0; x && k < count && !*folds; k++)
        *folds = !put_place(table, distance, k, x, x + count);
    kmp_table *made = x && !*folds ? kmp_table_new(KMP_TABLE_CUBIC, count, x, x + count) : NULL;
    kmp_free(x);
    return made;
}
