/* SPDX-License-Identifier: BSD-3-Clause */
/* A kind of closure consists of one or two parts: rows h as expressions, with the load of their multipliers. J, J qd
 * and gamma are derived from h by the engine. */
#pragma once

#include "dynamics/kinematics/link_tree.h"

enum { KMP_KIND_MAX_ROWS = KMP_CLOSURE_ROWS, KMP_KIND_POWER_OF_COORDINATE = -1, KMP_KIND_POWER_GIVEN = -2 };

typedef struct kmp_part {
    int rows;         /* declared rows, or their upper bound; rows that vanish identically are dropped later */
    int length_power; /* the unit of a row is m^length_power: rows are scaled by that power of the characteristic
                       * length; KMP_KIND_POWER_OF_COORDINATE: 0 for a rotation, 1 for a translation;
                       * KMP_KIND_POWER_GIVEN: the closure's own value */

    /** h; rows that are vector components have the axes of the nearest common ancestor of the points' bodies. */
    void (*residual)(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h);

    /** The force or moment on the second point's body at that point, in the axes of that ancestor, from one multiplier
     * per declared row (zero for a dropped one). A part that is not between points returns its generalized force and
     * two zeros; of gears the force on the second wheel at the pitch point, in the axes of the ground. The first
     * point's body carries the opposite load. */
    kmp_vec (*load)(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda);

    /** Rows between rates, linear in them, that are the rates of no h; false, or NULL: the rows are the rows of h. */
    bool (*rates)(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *rates);
} kmp_part;

typedef struct kmp_closure_parts {
    const kmp_part *force, *moment; /* the rows of the second follow the rows of the first */
} kmp_closure_parts;

/** The parts of a kind that a wing of the library has; no force part ends a list. */
typedef struct kmp_closure_of_wing {
    kmp_closure_kind kind;
    kmp_closure_parts parts;
} kmp_closure_of_wing;

/** The number of declared rows of a closure of the kind. */
int kmp_closure_rows(const kmp_closure_parts *kind, const kmp_closure *closure);

/** The rows of a closure between rates that are the rates of no h; false: it has none. */
bool kmp_closure_rates(const kmp_closure_parts *kind, const kmp_tree *tree, const kmp_closure *closure, kmp_ref *rates);

/** All rows of h. */
void kmp_closure_residual(const kmp_closure_parts *kind, const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h);

/** NULL if the kind does not exist in this build. */
const kmp_closure_parts *kmp_closure_parts_of(kmp_closure_kind kind);

/** True if the closure makes all axes of its points parallel. */
bool kmp_closure_aligns(const kmp_closure_parts *kind);

/** The load of a part that is not between points: its multiplier is the generalized force. */
kmp_vec kmp_part_effort(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda);

#define KMP_CLOSURE(name, needs, force, moment, ...) extern const kmp_part kmp_part_##force, kmp_part_##moment;
#define KMP_INNER_CLOSURE                            KMP_CLOSURE
#define KMP_CLOSURE_OF_WING(...)
#include "model/data/closure_kinds.def"
#undef KMP_CLOSURE

/** Declared rows of all closures. */
int kmp_closure_all_rows(const kempe_model *model);
