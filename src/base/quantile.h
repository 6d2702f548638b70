/* SPDX-License-Identifier: BSD-3-Clause */
/* Numbers in order, and their quantiles. */
#pragma once

/** Orders numbers by size. The quantile of ordered numbers, by linear interpolation between them: the first is part 0,
 * the last part 1. NaN: there are none. */
void kmp_order(int count, double *x);
double kmp_ordered_quantile(int count, const double *x, double part);
