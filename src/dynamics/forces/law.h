/* SPDX-License-Identifier: BSD-3-Clause */
/* The law of a force element adds its wrenches and generalized forces. With `energy` it adds the requested parts: its
 * potential where it has one and its power otherwise. One file for each row of model/data/force_kinds.def. */
#pragma once

#include "dynamics/forces/forces.h"
#include "dynamics/kinematics/touching.h"
#include "symbolic/derivative.h"

/** `value`: the values of an output force(NAME), initially zero; their number is in force_kinds.def. */
typedef void kmp_force_law(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy,
                           kmp_ref *value);

/** The law of a kind of force that a wing has; `law` NULL ends a list. */
typedef struct kmp_law_row {
    kmp_force_kind kind;
    kmp_force_law *law;
} kmp_law_row;

#define KMP_FORCE(kind, name, place, word, width) kmp_force_law kmp_law_##name;
#define KMP_FORCE_OF_WING(...)
#define KMP_FIELD(...)
#include "model/data/force_kinds.def"
#undef KMP_FORCE
#undef KMP_FIELD

/** A force at a point, given in the axes of an ancestor link, onto the point's link. */
void kmp_apply_at(const kmp_tree *tree, int point, int frame, kmp_vec force, kmp_wrench *applied);

/** A force on the first of two points and the opposite one on the second, in the axes of an ancestor link. */
void kmp_apply_between(kmp_forces *forces, const kmp_tree *tree, const int point[2], int frame, kmp_vec force);

/** A moment on the link of a point, likewise. */
void kmp_apply_moment(kmp_forces *forces, const kmp_tree *tree, int point, int frame, kmp_vec moment);

/** A tension along the line d from the first of two points to the second, whose length is given: law of an expression.
 * A constant one has a potential, any other counts its power. */
void kmp_pull_along(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, kmp_ref tension, bool constant,
                    unsigned energy);

void kmp_apply_effort(kmp_forces *forces, const kmp_tree *tree, int motion, kmp_ref effort);

/** power += effort * rate */
void kmp_add_power(kmp_forces *forces, const kmp_tree *tree, kmp_ref effort, kmp_ref rate);
