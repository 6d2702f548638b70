/* SPDX-License-Identifier: BSD-3-Clause */
/* The geometry of rails, tracks and wheels, which the reader computes from the numbers of the file. */
#pragma once

#include "model/data/wheels.h"

/* -- a rail in its track: turned by the inclination, placed by the gauge (rail.c) --------------------- */

/** The position of a rail: values given by the track, and results. */
typedef struct kmp_rail_place {
    double gauge, gauge_depth, inclination;
    double depth_given; /* out: the inner side reaches so far below the top, m */
    double at;          /* out: the profile's origin, laterally from the track's middle */
    bool reaches;       /* out: the gauge can be measured */
    bool resolved;      /* result: its points are distinct there */
} kmp_rail_place;

/** The height of an inclined rail over the lateral coordinate from the track's middle, zero on its top. The gauge is
 * measured between the inner sides at a depth below the top. Overhanging parts of the inclined rail are left out. NULL:
 * it does not reach the depth, is not resolved, or no memory. */
struct kmp_table *kmp_rail_new(const struct kmp_table *profile, kmp_rail_place *place);

/* -- the middle line of a track, from its course (read_course.c) ------------------------------------------
 *
 * Curvature is linear over the arc length in transitions (clothoids), cant too except at its corners, which are rounded
 * within half a metre. A jump of curvature becomes a transition within 5 cm. The line is integrated to rounding and
 * kept as cubic splines: positions within 1e-9 m, directions within 1e-8 rad of it. Before and after the course it is
 * straight. */

typedef enum kmp_course_result {
    KMP_COURSE_LAID,
    KMP_COURSE_MEMORY,
    KMP_COURSE_LARGE /* more points than KMP_MOST_COURSE_KNOTS */
} kmp_course_result;

enum { KMP_COURSE_SHORTEST = 1, KMP_COURSE_LONGEST = 1000 }; /* of a piece, in mm; of all pieces, in km */
