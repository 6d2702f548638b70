/* SPDX-License-Identifier: BSD-3-Clause */
/* A rail in its track: its cross-section turned by the inclination and placed by the gauge. */
#ifndef KMP_MODEL_RAIL_RAIL_H
#define KMP_MODEL_RAIL_RAIL_H

#include "model/rail/wheels.h"

/** How a rail lies: what a track says about it, and what came out. */
typedef struct kmp_rail_place {
    double gauge, gauge_depth, inclination;
    double depth_given; /* out: the inner side reaches so far below the top, m */
    double at;          /* out: the profile's origin, laterally from the track's middle */
    bool reaches;       /* out: the gauge can be measured */
    bool resolved;      /* out: its points can be told from each other there */
} kmp_rail_place;

/** The height of a rail that leans inwards over the lateral coordinate from the track's middle, zero on its top, the
 *  gauge measured between the inner sides at a depth below the top. What overhangs once it is turned is left out. NULL:
 *  it does not reach, is not resolved, or no memory. */
struct kmp_table *kmp_rail_new(const struct kmp_table *profile, kmp_rail_place *place);

/** What they own, and what they are made of stays. */
void kmp_profile_free(kmp_profile *profile);
void kmp_track_free(kmp_track *track);

#endif
