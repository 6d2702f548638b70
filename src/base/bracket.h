/* SPDX-License-Identifier: BSD-3-Clause */
/* A root between two places: one search for all that look for the place where something changes, each with values of
 * its own. False position with the Illinois rule (Dowell and Jarratt 1971), halves where that is slow. */
#ifndef KMP_BASE_BRACKET_H
#define KMP_BASE_BRACKET_H

#include <stdbool.h>

typedef struct kmp_bracket {
    double near, far;     /* the change lies between them; either may be the larger */
    double f_near, f_far; /* values there, one of them halved where the other end was replaced twice in a row */
    double width;         /* three points ago */
    int points, side;     /* points so far; which end the last one replaced */
} kmp_bracket;

/** Between `near` and `far`, with the values there; where their signs do not differ they say nothing: halves. */
kmp_bracket kmp_bracket_of(double near, double f_near, double far, double f_far);

/** The next place to look at, at least half the tolerance (> 0) from either end. false: it is narrowed to the
 * tolerance, or enough points have been looked at. */
bool kmp_bracket_next(const kmp_bracket *bracket, double tolerance, double *x);

/** The value at a place between. `beyond`: the change lies between `near` and there. */
void kmp_bracket_take(kmp_bracket *bracket, double x, double f, bool beyond);

/** The place of the least value between two places by golden section (Brent 1973, chapter 5), until they are nearer
 * than `width` to each other; of equal values towards `high`. */
double kmp_bracket_least(double (*of)(void *self, double x), void *self, double low, double high, double width);

#endif
