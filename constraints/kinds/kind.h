/* SPDX-License-Identifier: BSD-3-Clause */
/* A closure kind consists of one or two parts: rows h as expressions, with the load that their multipliers stand for.
 * J, J qd and gamma are derived from h by the engine. */
#ifndef KMP_CONSTRAINTS_KINDS_KIND_H
#define KMP_CONSTRAINTS_KINDS_KIND_H

#include "dynamics/kinematics/kinematics.h"

enum { KMP_KIND_MAX_ROWS = KMP_CLOSURE_ROWS, KMP_KIND_POWER_OF_COORDINATE = -1, KMP_KIND_POWER_GIVEN = -2 };

typedef struct kmp_part {
    int rows;         /* declared, or the most of them; rows that vanish identically are dropped later */
    int length_power; /* the unit of a row is m^length_power: rows are scaled by that power of the characteristic
                       * length; KMP_KIND_POWER_OF_COORDINATE: 0 for a rotation, 1 for a translation;
                       * KMP_KIND_POWER_GIVEN: what the closure says */

    /** h; rows that are components, in the axes of the nearest common ancestor of the points' bodies. */
    void (*residual)(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h);

    /** The force (of what is not between points: its effort and two zeros) or the moment on the second point's body at
     * that point, axes of the same ancestor, from one multiplier a declared row (zero for a dropped one). The first
     * point's body carries its opposite. */
    kmp_vec (*load)(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda);
} kmp_part;

typedef struct kmp_closure_kind {
    const char *name;
    const kmp_part *force, *moment; /* the rows of the second follow those of the first */
} kmp_closure_kind;

/** The declared rows of a closure of the kind. */
int kmp_closure_rows(const kmp_closure_kind *kind, const kmp_closure *closure);

/** All of h. */
void kmp_closure_residual(const kmp_closure_kind *kind, const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h);

/** NULL when there is no such kind. */
const kmp_closure_kind *kmp_closure_kind_find(const char *name);

/** The load of a part that is not between points: its multiplier is the effort. */
kmp_vec kmp_part_effort(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda);

#define KMP_KIND(name, force, moment) extern const kmp_part kmp_part_##force, kmp_part_##moment;
#include "constraints/kinds/kinds.def"
#undef KMP_KIND

#endif
