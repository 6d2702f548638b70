/* SPDX-License-Identifier: BSD-3-Clause */
/* Kalker, Three-Dimensional Elastic Bodies in Rolling Contact, 1990, table E.3: coefficients at g = 0.1 to 1, the
 * lesser over the greater semi-axis, for Poisson's ratios 0, 1/4, 1/2; and their asymptotes for slender ellipses.
 *
 * Over Poisson's ratio 1/C is a parabola through the three. Over log(a/b) log C is a cubic spline through the rows.
 * Beyond the rows it follows the asymptotes, times the last row's ratio to its asymptote, which fades with g. */
#include "rail/contact/kalker.h"
#include "base/context.h"
#include "base/spline.h"
#include <kempe/rolling_contact.h>
#include <math.h>

enum { ROWS = KMP_KALKER_ROWS, POINTS = KMP_KALKER_POINTS, COEFFICIENTS = KMP_KALKER_COEFFICIENTS, RATIOS = 3 };

/* [long across, long along][g = (row + 1)/10][coefficient][Poisson's ratio] */
static const double table[2][ROWS][COEFFICIENTS][RATIOS] = {
    {{{2.51, 3.31, 4.85}, {2.51, 2.52, 2.53}, {0.334, 0.473, 0.731}, {6.42, 8.28, 11.7}},
     {{2.59, 3.37, 4.81}, {2.59, 2.63, 2.66}, {0.483, 0.603, 0.809}, {3.46, 4.27, 5.66}},
     {{2.68, 3.44, 4.80}, {2.68, 2.75, 2.81}, {0.607, 0.715, 0.889}, {2.49, 2.96, 3.72}},
     {{2.78, 3.53, 4.82}, {2.78, 2.88, 2.98}, {0.720, 0.823, 0.977}, {2.02, 2.32, 2.77}},
     {{2.88, 3.62, 4.83}, {2.88, 3.01, 3.14}, {0.827, 0.929, 1.07}, {1.74, 1.93, 2.22}},
     {{2.98, 3.72, 4.91}, {2.98, 3.14, 3.31}, {0.930, 1.03, 1.18}, {1.56, 1.68, 1.86}},
     {{3.09, 3.81, 4.97}, {3.09, 3.28, 3.48}, {1.03, 1.14, 1.29}, {1.43, 1.50, 1.60}},
     {{3.19, 3.91, 5.05}, {3.19, 3.41, 3.65}, {1.13, 1.25, 1.40}, {1.34, 1.37, 1.42}},
     {{3.29, 4.01, 5.12}, {3.29, 3.54, 3.82}, {1.23, 1.36, 1.51}, {1.27, 1.27, 1.27}},
     {{3.40, 4.12, 5.20}, {3.40, 3.67, 3.98}, {1.33, 1.47, 1.63}, {1.21, 1.19, 1.16}}},
    {{{10.7, 11.7, 12.9}, {10.7, 12.8, 16.0}, {12.2, 14.6, 18.0}, {0.795, 0.526, 0.228}},
     {{6.96, 7.78, 8.82}, {6.96, 8.14, 9.79}, {5.72, 6.63, 7.89}, {0.828, 0.601, 0.341}},
     {{5.57, 6.34, 7.34}, {5.57, 6.40, 7.51}, {3.79, 4.32, 5.01}, {0.868, 0.674, 0.446}},
     {{4.84, 5.57, 6.57}, {4.84, 5.48, 6.31}, {2.88, 3.24, 3.70}, {0.912, 0.747, 0.549}},
     {{4.37, 5.10, 6.11}, {4.37, 4.90, 5.56}, {2.35, 2.62, 2.96}, {0.958, 0.819, 0.650}},
     {{4.06, 4.78, 5.80}, {4.06, 4.50, 5.04}, {2.01, 2.23, 2.50}, {1.01, 0.892, 0.751}},
     {{3.82, 4.54, 5.58}, {3.82, 4.21, 4.67}, {1.76, 1.95, 2.18}, {1.05, 0.965, 0.852}},
     {{3.65, 4.36, 5.42}, {3.65, 3.99, 4.39}, {1.58, 1.75, 1.94}, {1.10, 1.04, 0.954}},
     {{3.51, 4.22, 5.30}, {3.51, 3.81, 4.16}, {1.44, 1.59, 1.77}, {1.16, 1.11, 1.06}},
     {{3.40, 4.12, 5.20}, {3.40, 3.67, 3.98}, {1.33, 1.47, 1.63}, {1.21, 1.19, 1.16}}}};

/* g -> 0, the ellipse long across the direction of rolling. */
static void long_across(double g, double nu, double c[COEFFICIENTS])
{
    const double pi = 3.14159265358979323846;
    c[0] = pi * pi / (4 * (1 - nu));
    c[1] = pi * pi / 4;
    c[2] = pi * sqrt(g) / (3 * (1 - nu)) * (1 + nu * (log(16 / g) - 5));
    c[3] = pi * pi / (16 * (1 - nu) * g);
}

/* Long in the direction of rolling. */
static void long_along(double g, double nu, double c[COEFFICIENTS])
{
    const double pi = 3.14159265358979323846;
    double l = log(16 / (g * g)), x = l - 2 * nu, y = (1 - nu) * l + 2 * nu, spin = (1 - nu) * l - 2 + 4 * nu;
    c[0] = 2 * pi / (x * g) * (1 + (3 - log(4)) / x);
    c[1] = 2 * pi / (y * g) * (1 + (1 - nu) * (3 - log(4)) / y);
    c[2] = 2 * pi / (3 * g * sqrt(g) * spin);
    c[3] = 0.25 * pi * (1 - nu * (l - 2) / spin);
}

/* The table's row at nu. */
static void row_at(int side, int row, double nu, double c[COEFFICIENTS])
{
    double weight[RATIOS] = {(1 - 4 * nu) * (1 - 2 * nu), 8 * nu * (1 - 2 * nu), -2 * nu * (1 - 4 * nu)};
    for (int k = 0; k < COEFFICIENTS; k++) {
        double inverse = 0;
        for (int i = 0; i < RATIOS; i++)
            inverse += weight[i] / table[side][row][k][i];
        c[k] = 1 / inverse;
    }
}

/* Coefficients number `step` beyond the circle: a row, then the asymptote. Gives log g. */
static double point(int side, int step, double nu, double c[COEFFICIENTS])
{
    if (step < ROWS) {
        row_at(side, ROWS - 1 - step, nu, c);
        return step == 0 ? 0 : log(0.1 * (ROWS - step));
    }
    double last[COEFFICIENTS], there[COEFFICIENTS], log_g = log(0.1) - 0.4 * (step - ROWS + 1), g = exp(log_g);
    void (*asymptote)(double, double, double *) = side == 0 ? long_across : long_along;
    row_at(side, 0, nu, last);
    asymptote(0.1, nu, there);
    asymptote(g, nu, c);
    for (int k = 0; k < COEFFICIENTS; k++)
        c[k] *= 1 + (last[k] / there[k] - 1) * g / 0.1;
    return log_g;
}

void kmp_kalker_points(double poisson, double x[POINTS], double y[COEFFICIENTS][POINTS])
{
    enum { MIDDLE = ROWS + KMP_KALKER_BEYOND - 1 };
    for (int k = 0; k < POINTS; k++) {
        double c[COEFFICIENTS];
        int side = k > MIDDLE, step = side ? k - MIDDLE : MIDDLE - k;
        double log_g = point(side, step, poisson, c);
        x[k] = side ? -log_g : log_g;
        for (int i = 0; i < COEFFICIENTS; i++)
            y[i][k] = log(c[i]);
    }
}

/* The spline through `count` points at `at`, straight beyond its ends. */
static double spline_at(int count, const double *x, const double *y, double at)
{
    double slope[POINTS], work[2 * POINTS], piece[4];
    kmp_spline_slopes(count, x, y, slope, work);
    if (at < x[0])
        return y[0] + slope[0] * (at - x[0]);
    if (at > x[count - 1])
        return y[count - 1] + slope[count - 1] * (at - x[count - 1]);
    int k = 0;
    while (k < count - 2 && at >= x[k + 1])
        k++;
    kmp_spline_piece(x[k + 1] - x[k], y[k], y[k + 1], slope[k], slope[k + 1], piece);
    double d = at - x[k];
    return piece[0] + d * (piece[1] + d * (piece[2] + d * piece[3]));
}

kempe_status kempe_contact_kalker(double ratio, double poisson, kempe_kalker *coefficients)
{
    KMP_WANTED(NULL, coefficients, "coefficients");
    if (!isfinite(ratio) || ratio <= 0 || !(poisson >= 0 && poisson <= 0.5))
        return KEMPE_E_ARGUMENT;
    double x[POINTS], y[COEFFICIENTS][POINTS], c[COEFFICIENTS], at = log(ratio);
    kmp_kalker_points(poisson, x, y);
    for (int k = 0; k < COEFFICIENTS; k++)
        c[k] = exp(spline_at(POINTS, x, y[k], at));
    *coefficients = (kempe_kalker){.c11 = c[0], .c22 = c[1], .c23 = c[2], .c33 = c[3]};
    return KEMPE_OK;
}
