/* SPDX-License-Identifier: BSD-3-Clause */
/* The law of a force element adds its wrenches and generalized forces. With `energy` it adds the requested parts: its
 * potential where it has one and its power otherwise. The rows: model/data/force_kinds.def. */
#pragma once

#include "dynamics/forces/forces.h"
#include "dynamics/kinematics/touching.h"
#include "symbolic/derivative.h"

/** `value`: the values of an output force(NAME), initially zero; their number is in force_kinds.def. */
typedef void kmp_force_law(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy,
                           kmp_ref *value);

/** The law of a kind of force that a wing has; `law` NULL ends a list. `place` NULL: its forces are not drawn. */
typedef struct kmp_law_row {
    kmp_force_kind kind;
    kmp_force_law *law;
    kmp_force_place *place;
} kmp_law_row;

#define KMP_FORCE(kind, name, place, word, width) kmp_force_law kmp_law_##name;
#define KMP_FORCE_OF_WING(...)
#define KMP_FIELD(...)
#include "model/data/force_kinds.def"
#undef KMP_FORCE
#undef KMP_FIELD
