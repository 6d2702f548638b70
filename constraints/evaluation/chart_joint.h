/* SPDX-License-Identifier: BSD-3-Clause */
/* Charts of one spherical joint on plain arrays: constraints/evaluation/charts.h explains them. Coordinates belong to
 * all joints, of which three from `first` on are the joint's; `chart` is its C, row by row. Generated simulators
 * have this file too. */
#pragma once

#include <stdbool.h>

/* Linkage; static if one file contains all of a generated simulator. */
#ifndef KMP_LOCAL
#define KMP_LOCAL
#endif

enum { KMP_CHART_SIZE = 9 }; /* numbers of one C */

typedef struct kmp_chart_joint {
    const double *a, *b, *c; /* unit axes of the three angles, each across the next */
    int first;
    bool before; /* C comes before the three rotations */
} kmp_chart_joint;

/** A motion in some chart: coordinates, rates and accelerations (qdd may be NULL). */
typedef struct kmp_chart_motion {
    const double *chart, *q, *qd, *qdd;
} kmp_chart_motion;

/** True if C is exactly 1: the coordinates are then the user's. */
KMP_LOCAL bool kmp_chart_joint_is_own(const double *chart);

/** |determinant of the axes|: 1 in the middle, 0 where they are singular. */
KMP_LOCAL double kmp_chart_joint_regular(const kmp_chart_joint *j, const double *q);

/** Distance of the rotations by the user's angles in a and b: the largest difference of an entry. */
KMP_LOCAL double kmp_chart_joint_apart(const kmp_chart_joint *j, const double *a, const double *b);

/** Centres the joint: C, q and, if not NULL, qd and qdd are converted to the same motion in the new chart. The second
 * angle is then in the middle of its range and, when qd is given, at rest. */
KMP_LOCAL void kmp_chart_joint_center(const kmp_chart_joint *j, double *chart, double *q, double *qd, double *qdd);

/** Converts the user's rates at the user's angles (three each) to rates of the chart at q: the same motion. */
KMP_LOCAL void kmp_chart_joint_enter(const kmp_chart_joint *j, const double *chart, const double angles[3],
                                     const double rates[3], const double *q, double *qd);

/** Converts back to the user's coordinates: C = 1. The angles describe the same rotation and are nearest
 * to near[3], on either side of the singular position. At the singular position rates are least squares of least norm.
 * Returns the distance of the angles from `near`. */
KMP_LOCAL double kmp_chart_joint_show(const kmp_chart_joint *j, const double *chart, const double near[3], double *q,
                                      double *qd, double *qdd);

/** The user's angles of q, followed from near[3] shortly before: on the same side of the singular position when
 * `sided`, unless near[3] touches it, where motions pass through. Returns their distance from near[3], or the distance
 * of q from `before`, its values there, if that is larger: whole turns are visible only in q. They serve to be followed
 * and are not exact at a touch. */
KMP_LOCAL double kmp_chart_joint_follow(const kmp_chart_joint *j, const double *chart, const double *before,
                                        const double near[3], bool sided, const double *q, double angles[3]);

/** Converts small changes dq, dqd and dqdd (the last may be NULL) from one chart to changes of the same motion
 * in another. Both charts are unchanged. */
KMP_LOCAL void kmp_chart_joint_carry(const kmp_chart_joint *j, const kmp_chart_motion *from, const kmp_chart_motion *to,
                                     double *dq, double *dqd, double *dqdd);
