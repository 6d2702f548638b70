/* SPDX-License-Identifier: BSD-3-Clause */
/* The minimum of a convex quadratic function in a box: of 1/2 x' D x + a' x over lower <= x <= upper, D symmetric and
 * positive semidefinite. Its conditions are a linear complementarity problem with bounds: y = D x + a is zero inside,
 * not negative at a lower bound and not positive at an upper one. Friction forces that are bounded by their levels and
 * unilateral contacts are such x, with the accelerations y (Glocker 2001, section 7; Cottle, Pang and Stone 1992,
 * section 1.2).
 *
 * y is unique. x is unique unless D is singular on the entries inside. */
#pragma once

/* Linkage; static if one file contains all of a generated simulator. */
#ifndef KMP_LOCAL
#define KMP_LOCAL
#endif

typedef struct kmp_box {
    int n;
    const double *d;             /* n x n, column-major, both triangles */
    const double *a;             /* n */
    const double *lower, *upper; /* n: lower <= upper, also infinite; equal ones fix an entry */
} kmp_box;

typedef enum kmp_box_outcome {
    KMP_BOX_FOUND,
    KMP_BOX_UNBOUNDED, /* it has no minimum: some bounds are infinite */
    KMP_BOX_UNSETTLED  /* rounding prevents a decision */
} kmp_box_outcome;

/** Number of doubles of `room`. */
static inline int kmp_box_room(int n)
{
    return n * n + 4 * n;
}

/** x: a guess, then the minimum; y: D x + a there; side: -1 at the lower bound, 1 at the upper one, 0 inside. If there
 * are several x, only the guess decides between them. Does not allocate. */
KMP_LOCAL kmp_box_outcome kmp_box_minimum(const kmp_box *box, double *x, double *y, int *side, double *room);
