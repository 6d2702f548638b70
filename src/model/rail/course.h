/* SPDX-License-Identifier: BSD-3-Clause */
/* The middle line of a track from its course.
 *
 * Curvature is linear over the arc length in transitions (clothoids), cant too except at its corners, which are rounded
 * within half a metre. A jump of curvature becomes a transition within 5 cm. The line is integrated to rounding and
 * kept as cubic splines: positions within 1e-9 m, directions within 1e-8 rad of it. Before and after the course it is
 * straight. */
#ifndef KMP_MODEL_RAIL_COURSE_H
#define KMP_MODEL_RAIL_COURSE_H

#include "model/rail/wheels.h"

typedef enum kmp_course_result {
    KMP_COURSE_LAID,
    KMP_COURSE_MEMORY,
    KMP_COURSE_LARGE /* more points than KMP_MOST_COURSE_KNOTS */
} kmp_course_result;

enum { KMP_COURSE_SHORTEST = 1, KMP_COURSE_LONGEST = 1000 }; /* of a piece, in mm; of all pieces, in km */

/** Signed: a curve to the left is positive; 0 of a straight, and meaningless of a transition. */
double kmp_course_bend(const kmp_course_piece *piece);

/** Computes the course of a track: x, y, cant, candidates and length. Radii of curves are larger than its gauge, pieces
 * and their sum within the limits above. */
kmp_course_result kmp_course_lay(kmp_track *track);

#endif
