/* SPDX-License-Identifier: BSD-3-Clause */
#include "base/quantile.h"
#include <math.h>
#include <stdlib.h>

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

void kmp_order(int count, double *x)
{
    qsort(x, (size_t)count, sizeof *x, by_size);
}

double kmp_ordered_quantile(int count, const double *x, double part)
{
    double place = part * (count - 1);
    int k = (int)place;
    return count < 1 ? NAN : k + 1 < count ? x[k] + (place - k) * (x[k + 1] - x[k]) : x[count - 1];
}
