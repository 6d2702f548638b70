/* SPDX-License-Identifier: BSD-3-Clause */
/* Root bracketing for every search of a change, in the library and in generated simulators (C99), each with its own
 * function values: inverse quadratic interpolation,
 * and bisection where that is not monotonic (Chandrupatla 1997). */
#pragma once

#include <stdbool.h>

/* Linkage; static if one file contains all of a generated simulator. */
#ifndef KMP_LOCAL
#define KMP_LOCAL
#endif

typedef struct kmp_bracket {
    double near, far;        /* the change lies between near and far; either may be the larger */
    double f_near, f_far;    /* values there */
    double before, f_before; /* the end that the last point has replaced */
    int points;              /* points so far */
    bool last_is_far;        /* the last point is the far end */
} kmp_bracket;

/** A bracket between `near` and `far`, with the values there. Values of equal sign give no information: bisection. */
KMP_LOCAL kmp_bracket kmp_bracket_of(double near, double f_near, double far, double f_far);

/** The next abscissa to evaluate, at least half the tolerance (> 0) from either end. False if the bracket is narrowed
 * to the tolerance, or enough points have been evaluated. */
KMP_LOCAL bool kmp_bracket_next(const kmp_bracket *bracket, double tolerance, double *x);

/** Takes the value at an abscissa inside. `beyond`: the change lies between `near` and this abscissa. */
KMP_LOCAL void kmp_bracket_take(kmp_bracket *bracket, double x, double f, bool beyond);

/** The abscissa of the least value between `low` and `high` by golden section (Brent 1973, chapter 5), to a bracket
 * shorter than `width`. Of equal values it takes the one towards `high`. */
KMP_LOCAL double kmp_bracket_least(double (*of)(void *self, double x), void *self, double low, double high,
                                   double width);
