/* SPDX-License-Identifier: BSD-3-Clause */
/* Numbers shared by laws of numbers and laws of expressions: Kalker's creepage coefficients. */
#pragma once

#include <kempe/rolling_contact.h>

enum {
    KMP_KALKER_ROWS = 10,   /* of the table, on either side of the circle */
    KMP_KALKER_BEYOND = 12, /* points of the asymptotes there */
    KMP_KALKER_POINTS = 2 * (KMP_KALKER_ROWS + KMP_KALKER_BEYOND) - 1,
    KMP_KALKER_COEFFICIENTS = 4 /* c11, c22, c23, c33 */
};

/** Knots of a cubic spline: x = log(a/b), increasing, and the logarithms of the coefficients. Poisson's ratio is from 0
 * to 0.5. */
void kmp_kalker_points(double poisson, double x[KMP_KALKER_POINTS],
                       double y[KMP_KALKER_COEFFICIENTS][KMP_KALKER_POINTS]);

/** Creepage within which Polach's law has Kalker's coefficient of each axis for itself: above the creepages that
 * rounding leaves in a steady motion, 1e-16 to 1e-12, and far below the creepages at which forces matter. */
#define KMP_POLACH_NEAR 1e-9
