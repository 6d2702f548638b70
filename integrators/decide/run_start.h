/* SPDX-License-Identifier: BSD-3-Clause */
/* The start of a motion: its rate, the tolerances of its unknowns, and the length of its first step. The decisions of
 * runs, of lanes and of generated simulators, which have this file too. First step after Hairer, Norsett, Wanner,
 * Solving Ordinary Differential Equations I, 2nd ed., II.4. */
#pragma once

#include "integrators/decide/inlined.h"

/* -- the rate of a motion and tolerances ---------------------------------------------------------------- */

/** The rate, 1/s, of a motion that is not known yet: at most 1 over the span, and at most the rate of a pendulum as
 * long as the mechanism, where there is gravity (m/s^2). A short run does not make a resting mechanism fast. */
KMP_INLINE double kmp_start_least_rate(double span, double gravity, double length)
{
    return gravity > 0 ? fmin(1 / span, sqrt(gravity / length)) : 1 / span;
}

/** The rate of the motion, 1/s, of which tolerances of rates are: at least `least`, of n coordinates with their scales,
 * without states of the model. */
KMP_INLINE double kmp_start_rate(int n, const double *scale, const double *qd, const double *qdd, double least)
{
    double rate = least;
    for (int i = 0; i < n; i++) {
        rate = fmax(rate, fabs(qd[i]) / scale[i]);
        rate = fmax(rate, sqrt(fabs(qdd[i]) / scale[i]));
    }
    return rate;
}

/** Absolute tolerances of a coordinate and its rate. A state of the model is a rate, whose integral counts for nothing.
 */
KMP_INLINE void kmp_start_tolerance(int is_state, double tolerance, double rate, double *position, double *speed)
{
    *position = is_state ? KMP_UNCONTROLLED : tolerance;
    *speed = is_state ? tolerance : tolerance * rate;
}

/** Absolute tolerances of the unknowns u (p), ud (p) and v (r), `stride` apart. Coordinates from `motions` on are
 * states. */
KMP_INLINE void kmp_start_tolerances(int p, const int *u, int r, const int *v, int motions, const double *scale,
                                     double atol, double rate, ptrdiff_t stride, double *out)
{
    for (int k = 0; k < p; k++)
        kmp_start_tolerance(u[k] >= motions, atol * scale[u[k]], rate, &out[k * stride], &out[(p + k) * stride]);
    for (int i = 0; i < r; i++)
        out[(2 * p + i) * stride] = atol * scale[v[i]];
}

/* -- the first step ------------------------------------------------------------------------------------- */

/* Attempts at Euler's step, each a quarter of the one before, until the right-hand side can be evaluated at its end. */
enum { KMP_START_EULERS = 10 };

/** sum of ((a - b) / w)^2, of n numbers `stride` apart; b NULL: 0 */
KMP_INLINE double kmp_start_square(int n, ptrdiff_t stride, const double *a, const double *b, const double *w)
{
    double sum = 0.0;
    for (ptrdiff_t i = 0; i < n * stride; i += stride) {
        double e = (b ? a[i] - b[i] : a[i]) / w[i];
        sum += e * e;
    }
    return sum;
}

/** A step for which an explicit Euler step has an error of 1e-2 of the solution's size, from the weighted squares of
 * slope and solution; */
KMP_INLINE double kmp_start_euler(double slope, double size, double longest)
{
    return fmin(slope <= 1e-10 || size <= 1e-10 ? 1e-6 : 0.01 * sqrt(size / slope), longest);
}

/** then one from the largest weighted derivative: the derivative of the solution, or of its slope, the slope's change
 * over h. */
KMP_INLINE double kmp_start_step(double h, double most, int order, double longest)
{
    double h1 = most <= 1e-15 ? fmax(1e-6, 1e-3 * h) : pow(0.01 / most, 1.0 / order);
    return fmin(fmin(100 * h, h1), longest);
}
