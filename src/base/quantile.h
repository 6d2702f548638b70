/* SPDX-License-Identifier: BSD-3-Clause */
/* Numbers in order: places among them, and quantiles. */
#pragma once

/** Orders numbers by size. The quantile of ordered numbers, by linear interpolation between them: the first is part 0,
 * the last part 1. NaN: there are none. */
void kmp_order(int count, double *x);
double kmp_ordered_quantile(int count, const double *x, double part);

/** The last number up to x, of numbers in order from place `low` + 1 on and before `high`; `low`: there is none. */
static inline int kmp_ordered_last(const double *numbers, int low, int high, double x)
{
    while (high - low > 1) {
        const int middle = low + (high - low) / 2;
        if (numbers[middle] <= x)
            low = middle;
        else
            high = middle;
    }
    return low;
}
