/* SPDX-License-Identifier: BSD-3-Clause */
/* The minimum of a convex quadratic function (box_minimum.h) where some pairs of entries lie in discs about zero, as
 * the components of a friction force within Coulomb's cone do: |x_i, x_j| <= upper_i. Inside its disc a pair has y = 0;
 * on the circle y is opposite to x. */
#pragma once

#include "linalg/dense/box_minimum.h"

/** Number of doubles of `room`: for the groups of the entries, for the problem of the largest, and for Newton's method.
 */
static inline int kmp_disc_room(int n)
{
    return n + (n * n + 8 * n) + (kmp_box_room(n) + n * n + 4 * n) + (n * n / 4 + 8 * n);
}

/** As kmp_box_minimum. `partner` (n): the other entry of a disc, whose radius is the upper bound of both and whose
 * lower bounds are opposite; -1: a separate entry. Pairs with equal bounds are fixed. side: 1 for both entries of a
 * pair on its circle. */
KMP_LOCAL kmp_box_outcome kmp_disc_minimum(const kmp_box *box, const int *partner, double *x, double *y, int *side,
                                           double *room);
