/* SPDX-License-Identifier: BSD-3-Clause */
/* Force elements as applied wrenches on links, efforts on joints, and their energy. */
#pragma once

#include "dynamics/formalisms/newton_euler.h"
#include "model/data/force.h"

enum { KMP_FORCE_WIDTH = 10 }; /* values of an element, at most (force_kinds.def) */

typedef struct kmp_forces {
    kmp_wrench *applied; /* a link: force and moment about its origin, its axes */
    kmp_ref *effort;     /* a motion */
    kmp_ref potential;   /* of gravity, springs, bushings, stops, constant efforts, J */
    kmp_ref *value; /* KMP_FORCE_WIDTH per force element, shown by an output force(NAME): its tension, generalized force
                       on the joint, components */
    kmp_ref power;  /* of all other forces, W: zero when the model is conservative */
} kmp_forces;

/** Parts of the energy that are derived in addition to the forces. */
/** BY_LINKS: the potential of gravity in a number of operations in proportion to the links; other roundings. */
enum { KMP_ENERGY_POTENTIAL = 1, KMP_ENERGY_POWER = 2, KMP_ENERGY_BY_LINKS = 4 };

/** All force elements of the model, with the requested parts `energy`; other parts are zero. `alone`: the one that
 * acts, none where the model has no such element; NULL: all. Arrays are in the room of the graph, which fails when
 * there is no memory. */
void kmp_forces_init(kmp_forces *forces, const kmp_tree *tree, unsigned energy, const kmp_force *alone);

/** The place where a force acts and the axes of its first three values, in ground axes. NULL: no wing knows it. */
typedef void kmp_force_place(const kmp_tree *tree, const kmp_force *force, kmp_vec *place, kmp_vec axes[3]);
kmp_force_place *kmp_force_place_of(kmp_force_kind kind);

/** The forces of a compliant contact or a film, and the rates against which each works, at most KMP_COMPLIANT_FORCES:
 * their number. */
enum { KMP_COMPLIANT_FORCES = 7 };
int kmp_compliant_forces(const kmp_tree *tree, const kmp_force *force, kmp_ref *against, kmp_ref *size);

/** A force at a point, given in the axes of an ancestor link, onto the point's link. */
void kmp_apply_at(const kmp_tree *tree, int point, int frame, kmp_vec force, kmp_wrench *applied);

/** A force on the first of two points and the opposite one on the second, in the axes of an ancestor link. */
void kmp_apply_between(kmp_forces *forces, const kmp_tree *tree, const int point[2], int frame, kmp_vec force);

/** A moment on the link of a point, likewise. */
void kmp_apply_moment(kmp_forces *forces, const kmp_tree *tree, int point, int frame, kmp_vec moment);

void kmp_apply_effort(kmp_forces *forces, const kmp_tree *tree, int motion, kmp_ref effort);

/** power += effort * rate */
void kmp_add_power(kmp_forces *forces, const kmp_tree *tree, kmp_ref effort, kmp_ref rate);
