/* SPDX-License-Identifier: BSD-3-Clause */
/* Charts of spherical joints. The rotation of such a joint is C R_a(q1) R_b(q2) R_c(q3), or that with C behind it,
 * where the constant C may change between steps: where the three angles come near to their singular position the joint
 * is centred, that is, C takes over the rotation and the angles begin anew in the middle of their range. What a user
 * sees are always the angles of C = 1, the joint's own.
 *
 * R_a(q1) R_b(q2) R_c(q3) is singular where the second angle turns c onto the line of a: the determinant of the axes
 * (a, R_a b, R_a R_b c) is the sine of the angle between them, since b stands across a and c. */
#ifndef KMP_CONSTRAINTS_CLOSING_CHARTS_H
#define KMP_CONSTRAINTS_CLOSING_CHARTS_H

#include "dynamics/system.h"

enum { KMP_CHART_SIZE = 9 }; /* numbers of one C, row by row */

/** Joints that may be centred: none while a force of the user's own sees the coordinates. */
int kmp_charts_count(const kempe_system *system);

/** All C = 1. `chart` has room for the system's chart_count. */
void kmp_charts_reset(const kempe_system *system, double *chart);

/** The spherical joint that coordinate k belongs to; -1: none. */
int kmp_chart_of(const kempe_system *system, int k);

/** Whether C of joint c is 1 exactly: the coordinates are then the user's. */
bool kmp_chart_is_own(const double *chart, int c);

/** |determinant of the axes| of joint c: 1 in the middle, 0 where they are singular. */
double kmp_chart_regular(const kempe_system *system, int c, const double *q);

/** How far the rotations of joint c by the user's angles in a and b (n) are apart: the largest difference of an entry.
 */
double kmp_chart_apart(const kempe_system *system, int c, const double *a, const double *b);

/** Centres joint c: C, q and, where they are not NULL, qd and qdd (all n) are those of the same motion. The second
 * angle is then in the middle of its range and, when qd is given, stands still. */
void kmp_chart_center(const kempe_system *system, int c, double *chart, double *q, double *qd, double *qdd);

/** The user's rates at the user's angles, both of joint c (three each), as those of the chart at q: the same motion. */
void kmp_chart_enter(const kempe_system *system, int c, const double *chart, const double angles[3],
                     const double rates[3], const double *q, double *qd);

/** Back to the user's coordinates: C = 1. The angles are those nearest to near[3] that mean the same rotation, on
 * either side of the singular position; at it rates are the least that fit. Returns how far they are from `near`. */
double kmp_chart_show(const kempe_system *system, int c, const double *chart, const double near[3], double *q,
                      double *qd, double *qdd);

/** The user's angles of q where the motion is followed from near[3], which is not far before: on the same side of the
 *  singular position when `sided`, unless near[3] all but touches it, where motions go through. Returns how far they
 * are; they serve to be followed on and are not exact where they touch it. */
double kmp_chart_follow(const kempe_system *system, int c, const double *chart, const double near[3], bool sided,
                        const double *q, double angles[3]);

/** A motion in some charts: coordinates, rates and accelerations (n each; qdd may be NULL). */
typedef struct kmp_chart_motion {
    const double *chart, *q, *qd, *qdd;
} kmp_chart_motion;

/** Takes small changes dq, dqd and dqdd (n each; the last may be NULL) of the coordinates of joint c in one chart to
 * those of the same motion in another. Both charts stay as they are. */
void kmp_chart_carry(const kempe_system *system, int c, const kmp_chart_motion *from, const kmp_chart_motion *to,
                     double *dq, double *dqd, double *dqdd);

/** kmp_chart_show of all joints; `near` (n) may be q. */
void kmp_charts_show(const kempe_system *system, const double *chart, const double *near, double *q, double *qd);

#endif
