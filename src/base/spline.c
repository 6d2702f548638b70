/* SPDX-License-Identifier: BSD-3-Clause */
/* The derivatives at knots come from one tridiagonal system (de Boor, A Practical Guide to Splines, 1978, chapter IV),
 * which needs no exchange of rows. */
#include "base/spline.h"
#include <math.h>

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

/* The equations are dominated by their diagonal by a factor of two: each sweep halves the error at least. */
void kmp_spline_periodic_slopes(int count, const double *x, const double *y, double *slope)
{
    enum { SWEEPS = 64 };
    int last = count - 1;
    for (int k = 0; k < count; k++)
        slope[k] = (y[last] - y[0]) / (x[last] - x[0]);
    for (int sweep = 0; sweep < SWEEPS; sweep++) {
        for (int k = 0; k < last; k++) {
            int before = k > 0 ? k - 1 : last - 1;
            double h = x[before + 1] - x[before], g = x[k + 1] - x[k];
            double right = 3 * (g * secant(x, y, before) + h * secant(x, y, k));
            slope[k] = (right - g * slope[before] - h * slope[k + 1]) / (2 * (h + g));
            slope[last] = slope[0];
        }
    }
}

/* The slope at an end with steps h, g and secants m, n: the slope of the parabola within the shape of the points. */
static double end_slope(double h, double g, double m, double n)
{
    double slope = ((2 * h + g) * m - h * n) / (h + g);
    if (slope * m <= 0)
        return 0;
    return m * n <= 0 && fabs(slope) > 3 * fabs(m) ? 3 * m : slope;
}

/* The harmonic mean of both secants, with weights by the steps h, g; zero at an extreme value. */
static double mean_slope(double h, double g, double m, double n)
{
    return m * n > 0 ? 3 * (h + g) / ((2 * g + h) / m + (g + 2 * h) / n) : 0;
}

void kmp_monotone_slopes(int count, const double *x, const double *y, bool periodic, double *slope)
{
    int last = count - 1;
    for (int k = 1; k < last; k++)
        slope[k] = mean_slope(x[k] - x[k - 1], x[k + 1] - x[k], secant(x, y, k - 1), secant(x, y, k));
    double m = secant(x, y, 0), n = secant(x, y, last - 1), h = x[1] - x[0], g = x[last] - x[last - 1];
    if (periodic)
        slope[0] = slope[last] = mean_slope(g, h, n, m);
    else if (count == 2)
        slope[0] = slope[1] = m;
    else {
        slope[0] = end_slope(h, x[2] - x[1], m, secant(x, y, 1));
        slope[last] = end_slope(g, x[last - 1] - x[last - 2], n, secant(x, y, last - 2));
    }
}

void kmp_spline_piece(double h, double y, double z, double m, double n, double piece[4])
{
    double s = (z - y) / h, curvature = (m + n - 2 * s) / h;
    piece[0] = y;
    piece[1] = m;
    piece[2] = (s - m) / h - curvature;
    piece[3] = curvature / h;
}
