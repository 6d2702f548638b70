/* SPDX-License-Identifier: BSD-3-Clause */
/* Cubics through points. The spline: not-a-knot (the first two and the last two pieces are one cubic each; three points
 * make a parabola, two a line). */
#pragma once

#include <stdbool.h>

/** Derivatives at the `count` >= 2 knots; `work` has room for 2 * count numbers. */
void kmp_spline_slopes(int count, const double *x, const double *y, double *slope, double *work);

/** The same of a spline whose period is the range: two continuous derivatives all round. The slopes at both ends
 * are equal; the values may differ. */
void kmp_spline_periodic_slopes(int count, const double *x, const double *y, double *slope);

/** Slopes of cubics that rise and fall where the points do (Fritsch and Butland 1984): one continuous derivative, no
 * value beyond the values of both points. `periodic`: the first and the last point are one. */
void kmp_monotone_slopes(int count, const double *x, const double *y, bool periodic, double *slope);

/** The piece from x to x + h, with values y, z and derivatives m, n at its ends, in powers of the distance to x. */
void kmp_spline_piece(double h, double y, double z, double m, double n, double piece[4]);
