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

/* -- the middle line of a track, from its course (course.c) ------------------------------------------
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

/** Computes the course of a track: x, y, cant, candidates and length. Radii of curves are larger than its gauge, pieces
 * and their sum within the limits above. */
kmp_course_result kmp_course_lay(kmp_track *track);

/* -- irregularities from their spectral densities: sums of harmonics with random phases (wave_spectrum.c) -- */

/** Density of alignment, level or cross level at an angular frequency over the length, rad/m, in m^2/(rad/m). The
 * variance is its integral over the frequencies from the longest wavelength to the shortest one. 0 for other
 * irregularities. */
double kmp_wave_spectrum_density(int kind, kmp_irregularity what, double frequency);

/** The number of knots of a generated irregularity. */
double kmp_wave_spectrum_knots(const kmp_wave_spectrum *spectrum);

/** Generates one irregularity from a spectrum, zero at its ends and beyond; it is determined by the seed. NULL: no
 * memory. */
struct kmp_table *kmp_wave_spectrum_make(const kmp_wave_spectrum *spectrum, kmp_irregularity what);

/* -- the pieces of a wheel's profile that a rigid rail can touch (zones.c) ---------------------------- */

/** The scale of the lengths in the search for contact: the wheel's radius over 0.46 m. For a profile that is very wide
 * or narrow for that radius its width decides. */
double kmp_zones_scale(const kmp_wheel *wheel);

/** Samples the wheel over the rail, around its neutral position (kmp_zones_stand), at a few rolls, and notes the points
 * that touch. One zone ends, and the next one begins, in the middle of each jump of the point of contact. Jumps count
 * above 2 mm (for a wheel of 0.46 m, and in proportion). For an elastic wheel only jumps count over which the normal
 * turns by 0.3 rad or more. Jumps that overlap, at different rolls, share a border. Borders of the smallest jumps are
 * left out where there is no room. Returns the number of zones with room for all; 0: no memory. */
int kmp_zones_find(const kmp_track *track, kmp_wheel *wheel);

/** The spacing of the places in an elastic wheel's zones, and the least spread that they resolve. Both follow from the
 * curvatures of points that can touch there, sampled every 0.25 mm (for a wheel of 0.46 m). At edges with a radius
 * below 0.3 mm, and at edges that the sampling misses, places do not resolve it. A contact there may be off by half of
 * the 0.1 mm between them. False: no memory. */
bool kmp_zones_space(const kmp_track *track, kmp_wheel *wheel);

/** The neutral position of the wheel: a straight line with the slope in the middle of its profile, put on the rail. */
double kmp_zones_stand(const kmp_track *track, const kmp_wheel *wheel);
