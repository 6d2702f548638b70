/* SPDX-License-Identifier: BSD-3-Clause */
/* Zones by sampling: the wheel without yaw is put over the rail at many positions, at a few rolls, and lowered until
 * it touches. The heights of both are on fine even grids. */
#pragma once

#include "model/data/wheels.h"

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
