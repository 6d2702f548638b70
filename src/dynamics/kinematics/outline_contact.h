/* SPDX-License-Identifier: BSD-3-Clause */
/* A circle, or a point, and a piece of an outline: their distance, and the way of one along the other. */
#pragma once

#include "dynamics/kinematics/link_tree.h"
#include "dynamics/kinematics/vector.h"
#include "model/data/touch.h"

/** A circle in the axes of the outline: its centre; of a sharp corner that meets sharp corners also its edges, away
 * from it. */
typedef struct kmp_circle_place {
    kmp_vec at;
    kmp_ref edge[2][2];
} kmp_circle_place;

/** The distance where the piece counts, elsewhere a distance at which nothing touches. */
kmp_ref kmp_outline_gap(const kmp_tree *tree, const kmp_contact_pair *touch, const kmp_circle_place *place,
                        kmp_ref radius);

/** The direction out of the solid towards that place, in the same axes. */
void kmp_outline_normal(const kmp_tree *tree, const kmp_contact_pair *touch, const kmp_circle_place *place,
                        kmp_ref normal[2]);

/** The way of the circle along the piece, in the direction in which the outline is traversed; `rolled`: the way of its
 * rim by rolling. *turn: where it starts again (kmp_touching_way). */
kmp_ref kmp_outline_way(const kmp_tree *tree, const kmp_contact_pair *touch, const kmp_circle_place *place,
                        kmp_ref radius, kmp_ref rolled, kmp_ref *turn);

/** The velocity of the circle's material along the piece at its place of contact, m/s, also where it is deep: the
 * circle turns around an arc at its distance from the arc's centre. */
kmp_ref kmp_outline_slip(const kmp_tree *tree, const kmp_contact_pair *touch, const kmp_circle_place *place,
                         kmp_ref radius, kmp_ref rolled);
