/* SPDX-License-Identifier: BSD-3-Clause */
/* The geometry of a track as expressions. */
#pragma once

#include "dynamics/kinematics/link_tree.h"
#include "model/data/wheels.h"

/** A cross-section of a track; vectors in the axes of the ground's link. */
typedef struct kmp_track_place {
    kmp_ref along;   /* arc length, m */
    kmp_vec origin;  /* the middle on top of the rails, from the ground's origin */
    kmp_vec axis[3]; /* forwards, left, up: canted */
    kmp_ref outwards[KMP_TRACK_SIDES], upwards[KMP_TRACK_SIDES]; /* displacements of the rails by irregularities, m */
} kmp_track_place;

/** The cross-section in whose plane a point is (from the ground's origin, axes of the ground's link). Of a curved track
 *  the arc length is an implicit unknown, on a straight one nothing is. The graph fails when there is no memory. */
void kmp_track_at(const kmp_tree *tree, const kmp_track *track, kmp_vec point, kmp_track_place *place);
