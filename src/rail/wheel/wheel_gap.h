/* SPDX-License-Identifier: BSD-3-Clause */
/* The undeformed gap between a wheel and its rail at a state, as numbers: along the normal of a given plane of contact,
 * in strips across the direction of rolling. */
#pragma once

#include "model/data/wheels.h"
#include "rail/contact/gap.h"
#include <stdbool.h>

typedef struct kmp_wheel_gap kmp_wheel_gap;

/** A wheel whose pose has the KMP_POSE_SHOWN values of its output, in the zone of an elastic wheel, or anywhere on its
 * profile. The plane has a contact angle. Strips are counted from the wheel's point at s. NULL: no memory. */
kmp_wheel_gap *kmp_wheel_gap_new(const kmp_wheel *wheel, const kmp_track *track, int zone, const double *pose,
                                 double angle, double s);
void kmp_wheel_gap_free(kmp_wheel_gap *gap);

/** x of the point at s: the gap along x is least there. */
double kmp_wheel_gap_centre(const kmp_wheel_gap *gap);

/** The extent of the places, across, where both surfaces are functions over the plane: multiples of `step`, at most
 * `most` to either side. False: the point at s is not there. */
bool kmp_wheel_gap_range(const kmp_wheel_gap *gap, double step, int most, double *low, double *high);

/** Fills in the strips: count, first and step are given, within the range, and arrays with room. Lateral places on the
 * track are in `y`, less that of the point at s. False: a strip is not within the range. */
bool kmp_wheel_gap_sample(const kmp_wheel_gap *gap, kmp_strip_gap *strips, double *y);
