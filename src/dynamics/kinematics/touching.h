/* SPDX-License-Identifier: BSD-3-Clause */
/* The geometry of a contact (model/data/touch.h) as expressions: distance, normal, place and slip. Every law of
 * contact takes them from here; their derivatives are those of the graph. */
#pragma once

#include "dynamics/kinematics/link_tree.h"

/** Two sides at their places next to each other. Vectors are in the axes of link `frame`, the nearest common ancestor
 * of both bodies. */
typedef struct kmp_touching {
    int frame;
    kmp_ref gap;    /* m: distance of the surfaces, negative where they overlap */
    kmp_vec normal; /* unit vector out of the second side: the force on the first body pushes along it */
    kmp_vec arm[2]; /* from the point of each side to the place of contact, on the surface of the first side */
    kmp_vec across; /* m/s: velocity of the first body's material at the place relative to the second's, without its
                     * part along the normal */
} kmp_touching;

/** Geometry of a contact between two sides (touch->motion < 0, no touch->gap). `across` is zero unless `slips`. */
void kmp_touching_find(const kmp_tree *tree, const kmp_contact_pair *touch, bool slips, kmp_touching *touching);

/** The distance of any contact: of two sides, of a coordinate from its limit, an expression. */
kmp_ref kmp_touching_gap(const kmp_tree *tree, const kmp_contact_pair *touch);

/** The total time derivative of the distance. */
kmp_ref kmp_touching_rate(const kmp_tree *tree, const kmp_contact_pair *touch);

/** The generalized forces of 1 N along the normal, on the first body and opposite on the second: partial derivatives of
 * the distance by the coordinates (tree->count - 1). */
void kmp_touching_slopes(const kmp_tree *tree, const kmp_contact_pair *touch, kmp_ref *slope);

/** The way that the first side slides and rolls along the second, m. `along` 0: in the plane of motion, its rate is the
 * only component of `across`; 1, 2: along the first or the second axis of a plane's point after its normal, for a point
 * or a body that does not turn. *turn: the change of the way by a turn around a cylinder or a sphere, over 2 pi, where
 * the way starts again; zero on a plane. False where no function of the coordinates is this way, as of a sphere that
 * rolls in space, or on a profile. */
bool kmp_touching_way(const kmp_tree *tree, const kmp_contact_pair *touch, int along, kmp_ref *way, kmp_ref *turn);

/** A component of the slip, m/s, whether or not it is the rate of a way. `along` 0: in the plane of motion; 1, 2: on a
 * plane along the axes of its point after its normal; on a cylinder along its axis and around it; on a profile along
 * its curve and along z; on a sphere along the axes x and y of its point, turned with z to the normal. */
kmp_ref kmp_touching_slip(const kmp_tree *tree, const kmp_contact_pair *touch, int along);
