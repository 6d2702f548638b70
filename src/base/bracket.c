/* SPDX-License-Identifier: BSD-3-Clause */
#include "base/bracket.h"
#include <math.h>

enum { MOST_POINTS = 200 };

kmp_bracket kmp_bracket_of(double near, double f_near, double far, double f_far)
{
    return (kmp_bracket){.near = near, .f_near = f_near, .far = far, .f_far = f_far, .width = 2 * fabs(far - near)};
}

/* True if a bisection is due: at each third point, unless the width is at most a quarter of that three points ago. */
static bool is_slow(const kmp_bracket *b)
{
    return b->points % 3 == 2 && fabs(b->far - b->near) > b->width / 4;
}

bool kmp_bracket_next(const kmp_bracket *b, double tolerance, double *x)
{
    double width = b->far - b->near, part = b->f_near / (b->f_near - b->f_far), edge = 0.5 * tolerance / fabs(width);
    if (!(fabs(width) > tolerance) || b->points >= MOST_POINTS)
        return false;
    part = is_slow(b) || !(part >= 0 && part <= 1) ? 0.5 : part;
    *x = b->near + width * fmin(fmax(part, edge), 1 - edge);
    return true;
}

void kmp_bracket_take(kmp_bracket *b, double x, double f, bool beyond)
{
    if (b->points++ % 3 == 2)
        b->width = fabs(b->far - b->near);
    if (beyond) {
        b->far = x;
        b->f_far = f;
        b->f_near *= b->side < 0 ? 0.5 : 1;
        b->side = -1;
    } else {
        b->near = x;
        b->f_near = f;
        b->f_far *= b->side > 0 ? 0.5 : 1;
        b->side = 1;
    }
}

double kmp_bracket_least(double (*of)(void *self, double x), void *self, double low, double high, double width)
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
