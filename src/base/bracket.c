/* SPDX-License-Identifier: BSD-3-Clause */
#include "base/bracket.h"
#include <math.h>

enum { MOST_POINTS = 200 };

KMP_LOCAL kmp_bracket kmp_bracket_of(double near, double f_near, double far, double f_far)
{
    return (kmp_bracket){.near = near, .f_near = f_near, .far = far, .f_far = f_far};
}

/* The part of the bracket from its last point a to its other end b; c is the point that a has replaced. */
static double part_to(const kmp_bracket *b)
{
    double xa = b->last_is_far ? b->far : b->near, fa = b->last_is_far ? b->f_far : b->f_near;
    double xb = b->last_is_far ? b->near : b->far, fb = b->last_is_far ? b->f_near : b->f_far;
    double xc = b->before, fc = b->f_before;
    if (!(fa * fb < 0 || fa == 0 || fb == 0) || fa == fb)
        return 0.5;
    if (b->points == 0)
        return fa / (fa - fb);
    /* The inverse of the parabola through three points has to be monotonic between the ends. */
    const double xi = (xa - xb) / (xc - xb), phi = (fa - fb) / (fc - fb);
    if (!(phi * phi < xi && (1 - phi) * (1 - phi) < 1 - xi))
        return 0.5;
    return fa / (fb - fa) * (fc / (fb - fc)) + (xc - xa) / (xb - xa) * (fa / (fc - fa)) * (fb / (fc - fb));
}

KMP_LOCAL bool kmp_bracket_next(const kmp_bracket *b, double tolerance, double *x)
{
    double from = b->last_is_far ? b->far : b->near, width = b->last_is_far ? b->near - b->far : b->far - b->near;
    if (!(fabs(width) > tolerance) || b->points >= MOST_POINTS)
        return false;
    double part = part_to(b), edge = 0.5 * tolerance / fabs(width);
    part = isfinite(part) ? part : 0.5;
    *x = from + width * fmin(fmax(part, edge), 1 - edge);
    return true;
}

KMP_LOCAL void kmp_bracket_take(kmp_bracket *b, double x, double f, bool beyond)
{
    b->before = beyond ? b->far : b->near;
    b->f_before = beyond ? b->f_far : b->f_near;
    b->last_is_far = beyond;
    b->points++;
    if (beyond) {
        b->far = x;
        b->f_far = f;
    } else {
        b->near = x;
        b->f_near = f;
    }
}

KMP_LOCAL double kmp_bracket_least(double (*of)(void *self, double x), void *self, double low, double high,
                                   double width)
{
    const double golden = 0.38196601125010515;
    double x = low + golden * (high - low), y = high - golden * (high - low), at_x = of(self, x), at_y = of(self, y);
    while (high - low > width) {
        if (at_x < at_y) {
            high = y;
            y = x;
            at_y = at_x;
            x = low + golden * (high - low);
            at_x = of(self, x);
        } else {
            low = x;
            x = y;
            at_x = at_y;
            y = high - golden * (high - low);
            at_y = of(self, y);
        }
    }
    return (low + high) / 2;
}
