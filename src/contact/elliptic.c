/* SPDX-License-Identifier: BSD-3-Clause */
/* Arithmetic-geometric means (Abramowitz and Stegun 17.6): K = pi / (2 m), m the common limit of a and b from 1 and g.
 * D / K = (1 + sum 2^n c_n^2 / k^2)/2 over n >= 1, k^2 = 1 - g^2. The terms c_n^2 / k^2 follow each other without k, so
 * that the circle, g = 1, is no special case. */
#include "contact/elliptic.h"
#include <math.h>

void kmp_elliptic(double g, double *B, double *D)
{
    const double pi = 3.14159265358979323846;
    double a = 1, b = g, c = 0, term = 0, sum = 1, weight = 1;
    do {
        double mean = 0.5 * (a + b);
        /* c_1^2 / k^2 = (1 - g) / (4 (1 + g)), and c_(n+1) = c_n^2 / (4 a_(n+1)) */
        term = weight == 1 ? 0.25 * (1 - g) / (1 + g) : term * c * c / (16 * mean * mean);
        c = 0.5 * (a - b);
        b = sqrt(a * b);
        a = mean;
        weight *= 2;
        sum += weight * term;
    } while (c > 1e-8 * a); /* the next one is below its square: quadratic */
    double K = 0.5 * pi / a;
    *D = 0.5 * K * sum;
    *B = K - *D;
}
