/* SPDX-License-Identifier: BSD-3-Clause */
/* The pieces of a wheel's profile that a rigid rail can touch. */
#ifndef KMP_MODEL_RAIL_ZONES_H
#define KMP_MODEL_RAIL_ZONES_H

#include "model/rail/wheels.h"

/** By which the lengths go with which contact is looked for: the wheel's radius over 0.46 m. Where the profile is very
 * wide or narrow for that radius its width decides. */
double kmp_zones_scale(const kmp_wheel *wheel);

/** Puts the wheel all over the rail, from where it stands (below), at a few rolls, and notes what touches. Where the
 * point of contact jumps by more than 2 mm (of a wheel of 0.46 m, and in proportion) one zone ends and the next one
 * begins, in the middle of what is passed over; of an elastic wheel only by those jumps over which the normal turns by
 * 0.3 rad or more. Jumps that overlap, at different rolls, share a border. Of more borders than there is room for those
 * of the smallest jumps are left out. How many zones there would be with room for all; 0: no memory. */
int kmp_zones_find(const kmp_track *track, kmp_wheel *wheel);

/** How near to each other the places of an elastic wheel's zones are, and the least spread that they resolve, by the
 * curvatures of what can touch there, looked at every 0.25 mm (of a wheel of 0.46 m). At edges with a radius below
 * 0.3 mm, and at those that are missed in this way, they do not resolve it: a contact there may be off by half of the
 * 0.1 mm between them. false: no memory. */
bool kmp_zones_space(const kmp_track *track, kmp_wheel *wheel);

/** Where the wheel stands with the middle of its profile: a straight line of its slope there, put on the rail. */
double kmp_zones_stand(const kmp_track *track, const kmp_wheel *wheel);

#endif
