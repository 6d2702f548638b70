/* SPDX-License-Identifier: BSD-3-Clause */
/* Distributions of one quantity by their quantile functions. */
#pragma once

#include <kempe/kempe.h>

typedef enum kmp_distribution_kind { KMP_UNIFORM, KMP_NORMAL, KMP_TRIANGULAR } kmp_distribution_kind;

typedef struct kmp_distribution {
    kmp_distribution_kind kind;
    double least, most;   /* infinite for a normal one that is not truncated */
    double centre, width; /* mean and standard deviation of the normal distribution before truncation; mode */
} kmp_distribution;

/** The value below which the share `part` of all values lies, 0 < part < 1. */
double kmp_distribution_quantile(const kmp_distribution *d, double part);

/** Standard normal distribution: the share below z, and its inverse. */
double kmp_normal_share(double z);
double kmp_normal_quantile(double part);

/** The tolerance of a nominal size by a grade of ISO 286-1, 5 to 18, in m; 0: the size is not above 0, or above 3.15 m.
 */
double kmp_tolerance_grade(int grade, double size);
enum { KMP_GRADE_LEAST = 5, KMP_GRADE_MOST = 18 };
