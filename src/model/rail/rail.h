/* SPDX-License-Identifier: BSD-3-Clause */
/* A rail in its track: its cross-section turned by the inclination and placed by the gauge. */
#ifndef KMP_MODEL_RAIL_RAIL_H
#define KMP_MODEL_RAIL_RAIL_H

#include "model/rail/wheels.h"

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

/** Frees the tables owned by a profile; the named tables it refers to remain. */
void kmp_profile_free(kmp_profile *profile);
void kmp_track_free(kmp_track *track);

#endif
