/* SPDX-License-Identifier: BSD-3-Clause */
#include "ensemble/statistics/shares.h"
#include <float.h>
#include <math.h>
#include <stdbool.h>

enum { MOST_TERMS = 20000, MOST_HALVINGS = 200 };

/* The continued fraction of the incomplete beta function by Lentz's method (DLMF 8.17.22). */
static double fraction(double x, double a, double b)
{
    double c = 1, d = 1 - (a + b) * x / (a + 1);
    d = 1 / (fabs(d) < DBL_MIN ? DBL_MIN : d);
    double h = d;
    for (int m = 1; m < MOST_TERMS; m++) {
        const double terms[2] = {m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m)),
                                 -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1))};
        double change = 1;
        for (int i = 0; i < 2; i++) {
            d = 1 + terms[i] * d;
            c = 1 + terms[i] / c;
            d = 1 / (fabs(d) < DBL_MIN ? DBL_MIN : d);
            c = fabs(c) < DBL_MIN ? DBL_MIN : c;
            change = c * d;
            h *= change;
        }
        if (fabs(change - 1) < 2 * DBL_EPSILON)
            break;
    }
    return h;
}

double kmp_beta_share(double x, double a, double b)
{
    if (!(x > 0))
        return 0;
    if (x >= 1)
        return 1;
    double front = exp(lgamma(a + b) - lgamma(a) - lgamma(b) + a * log(x) + b * log1p(-x));
    return x < (a + 1) / (a + b + 2) ? front * fraction(x, a, b) / a : 1 - front * fraction(1 - x, b, a) / b;
}

/* Bisection: shares are monotone, and steps of Newton's method may leave the interval. */
double kmp_beta_quantile(double part, double a, double b)
{
    double low = 0, high = 1;
    if (!(a > 0) || !(b > 0))
        return a > 0 ? 1 : 0;
    for (int k = 0; k < MOST_HALVINGS && high - low > DBL_EPSILON * high; k++) {
        double middle = 0.5 * (low + high);
        if (kmp_beta_share(middle, a, b) < part)
            low = middle;
        else
            high = middle;
    }
    return 0.5 * (low + high);
}

/* The share of both tails beyond t is I_x(f/2, 1/2) at x = f/(f + t^2); near t = 0 its complement has the digits. */
double kmp_student_quantile(double part, double freedoms)
{
    double tail = part < 0.5 ? part : 1 - part, square;
    if (tail < 0.25) {
        double x = kmp_beta_quantile(2 * tail, freedoms / 2, 0.5);
        square = freedoms * (1 - x) / x;
    } else {
        double y = kmp_beta_quantile(1 - 2 * tail, 0.5, freedoms / 2);
        square = freedoms * y / (1 - y);
    }
    return part < 0.5 ? -sqrt(square) : sqrt(square);
}

double kmp_binomial_share(int k, int n, double p)
{
    return k < 0 ? 0 : k >= n ? 1 : kmp_beta_share(1 - p, n - k, k + 1.0);
}

void kmp_chance_interval(int k, int n, double confidence, double *low, double *high)
{
    double tail = 0.5 * (1 - confidence);
    *low = kmp_beta_quantile(tail, k, n - k + 1.0);
    *high = kmp_beta_quantile(1 - tail, k + 1.0, n - k);
}

/* The largest place whose samples above it hold the quantile; `above`: the least place above it. */
static int place_beside(int n, double part, double tail, bool above)
{
    int from = 0, to = n + 1;
    while (to - from > 1) {
        int middle = from + (to - from) / 2;
        double share = kmp_binomial_share(middle - 1, n, part);
        if (above ? 1 - share <= tail : share > tail)
            to = middle;
        else
            from = middle;
    }
    return above ? to : from;
}

void kmp_quantile_places(int n, double part, double confidence, int *low, int *high)
{
    double tail = 0.5 * (1 - confidence);
    *low = place_beside(n, part, tail, false);
    *high = place_beside(n, part, tail, true);
}
