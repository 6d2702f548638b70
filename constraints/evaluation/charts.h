/* SPDX-License-Identifier: BSD-3-Clause */
/* Charts of spherical joints. The rotation of such a joint is C R_a(q1) R_b(q2) R_c(q3), or this product with C behind
 * it. The constant C may change between steps: near the singular position of the three angles the joint is centred. C
 * then takes over the rotation, and the angles begin in the middle of their range. Users always see the angles of C =
 * 1, the joint's own.
 *
 * R_a(q1) R_b(q2) R_c(q3) is singular where the second angle turns c onto the line of a: the determinant of the axes
 * (a, R_a b, R_a R_b c) is the sine of the angle between them, since b is perpendicular to a and c. */
#pragma once

#include "constraints/evaluation/chart_joint.h"
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

/** As the functions of chart_joint.h for joint c: coordinates, rates and accelerations have n entries, `chart` has all
 * C. kmp_chart_nearest replaces the user's angles by the angles of the same rotation that are nearest to `near`. */
double kmp_chart_apart(const kempe_system *system, int c, const double *a, const double *b);
void kmp_chart_nearest(const kempe_system *system, int c, const double near[3], double angles[3]);
void kmp_chart_center(const kempe_system *system, int c, double *chart, double *q, double *qd, double *qdd);
void kmp_chart_enter(const kempe_system *system, int c, const double *chart, const double angles[3],
                     const double rates[3], const double *q, double *qd);
double kmp_chart_show(const kempe_system *system, int c, const double *chart, const double near[3], double *q,
                      double *qd, double *qdd);
double kmp_chart_follow(const kempe_system *system, int c, const double *chart, const double *before,
                        const double near[3], bool sided, const double *q, double angles[3]);
void kmp_chart_carry(const kempe_system *system, int c, const kmp_chart_motion *from, const kmp_chart_motion *to,
                     double *dq, double *dqd, double *dqdd);

/** Applies kmp_chart_show to all joints; `near` (n) may be q. */
void kmp_charts_show(const kempe_system *system, const double *chart, const double *near, double *q, double *qd);
