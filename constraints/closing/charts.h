/* SPDX-License-Identifier: BSD-3-Clause */
/* Charts of spherical joints. The rotation of such a joint is C R_a(q1) R_b(q2) R_c(q3), or this product with C behind
 * it. The constant C may change between steps: near the singular position of the three angles the joint is centred. C
 * then takes over the rotation, and the angles begin in the middle of their range. Users always see the angles of C =
 * 1, the joint's own.
 *
 * R_a(q1) R_b(q2) R_c(q3) is singular where the second angle turns c onto the line of a: the determinant of the axes
 * (a, R_a b, R_a R_b c) is the sine of the angle between them, since b is perpendicular to a and c. */
#pragma once

#include "constraints/closing/chart_joint.h"
#include "dynamics/system.h"

/** The number of joints that may be centred: 0 while a user-defined force sees the coordinates. */
int kmp_charts_count(const kempe_system *system);

/** Sets all C = 1. `chart` has room for the system's chart_count. */
void kmp_charts_reset(const kempe_system *system, double *chart);

/** The spherical joint that coordinate k belongs to; -1: none. */
int kmp_chart_of(const kempe_system *system, int k);

/** True if C of joint c is exactly 1: the coordinates are then the user's. */
bool kmp_chart_is_own(const double *chart, int c);

/** True if that holds for all joints that may be centred. */
bool kmp_charts_are_own(const kempe_system *system, const double *chart);

/** |determinant of the axes| of joint c: 1 in the middle, 0 where they are singular. */
double kmp_chart_regular(const kempe_system *system, int c, const double *q);

/** Distance of the rotations of joint c by the user's angles in a and b (n): the largest difference of an entry. */
double kmp_chart_apart(const kempe_system *system, int c, const double *a, const double *b);

/** Replaces the user's angles of joint c by those of the same rotation that are nearest to `near`. */
void kmp_chart_nearest(const kempe_system *system, int c, const double near[3], double angles[3]);

/** Centres joint c: C, q and, if not NULL, qd and qdd (all n) become those of the same motion in the new chart. The
 * second angle is then in the middle of its range and, when qd is given, at rest. */
void kmp_chart_center(const kempe_system *system, int c, double *chart, double *q, double *qd, double *qdd);

/** Converts the user's rates at the user's angles, both of joint c (three each), to those of the chart at q: the same
 * motion. */
void kmp_chart_enter(const kempe_system *system, int c, const double *chart, const double angles[3],
                     const double rates[3], const double *q, double *qd);

/** Converts back to the user's coordinates: C = 1. The angles are those of the same rotation that are nearest to
 * near[3], on either side of the singular position. At the singular position rates are least squares of least norm.
 * Returns the distance of the angles from `near`. */
double kmp_chart_show(const kempe_system *system, int c, const double *chart, const double near[3], double *q,
                      double *qd, double *qdd);

/** The user's angles of q, followed from near[3] shortly before: on the same side of the singular position when
 * `sided`, unless near[3] touches it, where motions pass through. Returns their distance from near[3]. They serve to be
 * followed and are not exact at a touch. */
double kmp_chart_follow(const kempe_system *system, int c, const double *chart, const double near[3], bool sided,
                        const double *q, double angles[3]);

/** Converts small changes dq, dqd and dqdd (n each; the last may be NULL) of the coordinates of joint c from one chart
 * to those of the same motion in another. Both charts are unchanged. */
void kmp_chart_carry(const kempe_system *system, int c, const kmp_chart_motion *from, const kmp_chart_motion *to,
                     double *dq, double *dqd, double *dqdd);

/** Applies kmp_chart_show to all joints; `near` (n) may be q. */
void kmp_charts_show(const kempe_system *system, const double *chart, const double *near, double *q, double *qd);
