/* SPDX-License-Identifier: BSD-3-Clause */
/* A function of time on an interval as a polynomial through its values at Chebyshev's points: whether it is smooth
 * there, its integral, its extremes, and where it changes its sign. */
#pragma once

#include <stdbool.h>

enum { KMP_PIECE_POINTS = 9 }; /* at both ends and between them */

/** Abscissa of a point, -1 to 1, ascending. */
double kmp_piece_point(int k);

typedef struct kmp_smooth_piece {
    double from, to;
    double first, last;         /* values at the ends, without rounding of the sum */
    double c[KMP_PIECE_POINTS]; /* coefficients of Chebyshev's polynomials, the first one halved */
} kmp_smooth_piece;

/** The polynomial through values at the points of [from, to]. */
kmp_smooth_piece kmp_piece_of(double from, double to, const double values[KMP_PIECE_POINTS]);

/** Bounds that no value passes, from only the points 0, 2, 4, 6 and 8: the bounds of the polynomial through them, and a
 * multiple of its last terms for the ones that it lacks. */
void kmp_piece_rough_bounds(const double values[KMP_PIECE_POINTS], double *low, double *high);

/** Estimated error of the polynomial: the size of its last terms. */
double kmp_piece_error(const kmp_smooth_piece *piece);

double kmp_piece_integral(const kmp_smooth_piece *piece);

/** The value at an abscissa, -1 to 1; its time. */
double kmp_piece_value(const kmp_smooth_piece *piece, double x);
double kmp_piece_time(const kmp_smooth_piece *piece, double x);

/** Bounds that no value passes. */
void kmp_piece_extremes(const kmp_smooth_piece *piece, double *low, double *high);

/** Abscissae between which the polynomial rises or falls throughout, from -1 to 1, both included; their number, at most
 * KMP_PIECE_POINTS. */
int kmp_piece_turns(const kmp_smooth_piece *piece, double x[KMP_PIECE_POINTS]);

/** The abscissa between two others at which the value is zero; the values there have different signs. */
double kmp_piece_zero(const kmp_smooth_piece *piece, double low, double high);
