/* SPDX-License-Identifier: BSD-3-Clause */
/* The cubic spline through points: not-a-knot (the first two and the last two pieces are one cubic each; three points
 * make a parabola, two a line). */
#pragma once

/** Derivatives at the `count` >= 2 knots; `work` has room for 2 * count numbers. */
void kmp_spline_slopes(int count, const double *x, const double *y, double *slope, double *work);

/** The piece from x to x + h, with values y, z and derivatives m, n at its ends, in powers of the distance to x. */
void kmp_spline_piece(double h, double y, double z, double m, double n, double piece[4]);
