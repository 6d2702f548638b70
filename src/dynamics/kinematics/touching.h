/* SPDX-License-Identifier: BSD-3-Clause */
/* The geometry of a contact (model/data/touch.h) as expressions: distance, normal, place and slip. Every law of
 * contact takes them from here; the graph gives their derivatives. */
#pragma once

#include "dynamics/kinematics/link_tree.h"
#include "model/data/compliant.h"

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

/** Geometry of a contact between two sides (touch->motion < 0, no touch->gap). `across` is zero unless `slips`, which
 * pieces of outlines do not have here. */
void kmp_touching_find(const kmp_tree *tree, const kmp_contact_pair *touch, bool slips, kmp_touching *touching);

/** The distance of any contact: of two sides, of a coordinate from its limit, an expression. */
kmp_ref kmp_touching_gap(const kmp_tree *tree, const kmp_contact_pair *touch);

/** The total time derivative of the distance. */
kmp_ref kmp_touching_rate(const kmp_tree *tree, const kmp_contact_pair *touch);

/** The generalized forces of 1 N along the normal, on the first body and opposite on the second: partial derivatives of
 * the distance by those coordinates on which it may depend, which are listed, in the graph's arena; returns how many.
 */
int kmp_touching_slopes(const kmp_tree *tree, const kmp_contact_pair *touch, int **motion, kmp_ref **slope);

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

/** The unit vector of that component, or of the rate of the way: friction on the first body acts along it. `normal` and
 * the result are in the axes of kmp_touching's frame. */
kmp_vec kmp_touching_direction(const kmp_tree *tree, const kmp_contact_pair *touch, kmp_vec normal, int along);

/** Conditions of a contact, numbers of kmp_tree_condition: its bodies touch; its law would pull; its journal is out of
 * the bearing; its law has no force at so great a depth; its film has its least thickness. */
enum { KMP_PRESSING, KMP_PRESSING_PULLS, KMP_PRESSING_OUT, KMP_PRESSING_DEEP, KMP_PRESSING_THIN };

typedef struct kmp_bearing_load {
    kmp_ref open;                  /* negative where the bodies touch: the gap, or a smooth function of it */
    kmp_ref depth, rate;           /* of approach; only meaningful near contact */
    kmp_ref slip[3];               /* velocity along the surface, linear in the rates */
    int slips;                     /* 1: with a sign; 3: a vector; 0: the contact has no friction */
    kmp_ref x, y, z, eccentricity; /* of a journal's centre in its bearing; z of a ball */
} kmp_bearing_load;

void kmp_bearing_load_find(const kmp_tree *tree, const kmp_force *force, kmp_bearing_load *pressing);

/** 1 where the bodies touch, during a step an input. */
kmp_ref kmp_bearing_load_holds(const kmp_tree *tree, const kmp_force *force, const kmp_bearing_load *pressing);

/** The normal force, zero without contact and where the law would pull. */
kmp_ref kmp_bearing_load_normal(const kmp_tree *tree, const kmp_force *force, const kmp_bearing_load *pressing);

/** An expression of the law, over the quantities of the contact. */
kmp_ref kmp_bearing_load_law(const kmp_tree *tree, const kmp_force *force, const kmp_bearing_load *pressing,
                             const kmp_expr *law);

/** The coefficient of friction at a slip. */
kmp_ref kmp_bearing_load_coefficient(const kmp_tree *tree, const kmp_force *force, kmp_ref slip);

/** Depth, approach or normal force, as measures of expressions. */
kmp_ref kmp_bearing_load_measure(const kmp_tree *tree, kmp_measure_kind kind, const char *contact);
