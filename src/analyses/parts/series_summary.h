/* SPDX-License-Identifier: BSD-3-Clause */
/* The extreme values, mean and root mean square of a series. */
#pragma once

/** Extreme values are taken from rows, the first of equal ones. Mean and root mean square are integrals over x by the
 * trapezoidal rule, over its range. All are NaN where no value is known. */
typedef struct kmp_series_summary {
    double low, low_at, high, high_at, mean, rms;
} kmp_series_summary;

/** x ascends or descends; value k is y[k * stride]; values that are not finite leave a gap. */
kmp_series_summary kmp_series_summarise(int rows, const double *x, const double *y, int stride);
