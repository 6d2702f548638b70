/* SPDX-License-Identifier: BSD-3-Clause */
/* The derivatives at knots come from one tridiagonal system (de Boor, A Practical Guide to Splines, 1978, chapter IV),
 * which needs no exchange of rows. */
#include "base/spline.h"

static double secant(const double *x, const double *y, int k)
{
    return (y[k + 1] - y[k]) / (x[k + 1] - x[k]);
}

/* The end condition at the end with steps h, g and secants m, n: (g, h + g) slopes = *right. */
static double end_row(double h, double g, double m, double n)
{
    double d = h + g;
    return ((h + 2 * d) * g * m + h * h * n) / d;
}

/* A spline through four or more knots. */
static void spline_slopes(int n, const double *x, const double *y, double *slope, double *pivot, double *upper)
{
    pivot[0] = x[2] - x[1];
    upper[0] = x[2] - x[0];
    slope[0] = end_row(x[1] - x[0], x[2] - x[1], secant(x, y, 0), secant(x, y, 1));
    for (int k = 1; k < n; k++) {
        double lower, h = x[k] - x[k - 1];
        if (k < n - 1) {
            double g = x[k + 1] - x[k];
            lower = g;
            pivot[k] = 2 * (h + g);
            upper[k] = h;
            slope[k] = 3 * (g * secant(x, y, k - 1) + h * secant(x, y, k));
        } else {
            double g = x[k - 1] - x[k - 2];
            lower = h + g;
            pivot[k] = g;
            slope[k] = end_row(h, g, secant(x, y, k - 1), secant(x, y, k - 2));
        }
        double factor = lower / pivot[k - 1];
        pivot[k] -= factor * upper[k - 1];
        slope[k] -= factor * slope[k - 1];
    }
    slope[n - 1] /= pivot[n - 1];
    for (int k = n - 2; k >= 0; k--)
        slope[k] = (slope[k] - upper[k] * slope[k + 1]) / pivot[k];
}

/* The parabola through three points. */
static void parabola_slopes(const double *x, const double *y, double *slope)
{
    double h = x[1] - x[0], g = x[2] - x[1], m = secant(x, y, 0), n = secant(x, y, 1);
    double curvature = (n - m) / (h + g);
    slope[0] = m - h * curvature;
    slope[1] = m + h * curvature;
    slope[2] = n + g * curvature;
}

void kmp_spline_slopes(int count, const double *x, const double *y, double *slope, double *work)
{
    if (count == 2)
        slope[0] = slope[1] = secant(x, y, 0);
    else if (count == 3)
        parabola_slopes(x, y, slope);
    else
        spline_slopes(count, x, y, slope, work, work + count);
}

void kmp_spline_piece(double h, double y, double z, double m, double n, double piece[4])
{
    double s = (z - y) / h, curvature = (m + n - 2 * s) / h;
    piece[0] = y;
    piece[1] = m;
    piece[2] = (s - m) / h - curvature;
    piece[3] = curvature / h;
}
