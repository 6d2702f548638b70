/* SPDX-License-Identifier: BSD-3-Clause */
/* Forces with the places where they act, as expressions: normal force and friction of contacts together, the components
 * of tyres, the ends of ropes, ideal followers of cams. Pages draw them. Joints, and gears, have their reactions. */
#pragma once

#include "dynamics/forces/forces.h"

/** A force on a body; of a contact with outlines the forces of its pairs, of which few act at one time. */
typedef struct kmp_placed_force {
    int row;          /* of its kind, in placed_forces.c */
    const char *kind; /* "contacts", "tyres", "ropes" */
    const char *name;
    const char *label; /* at the tip of an arrow; "": none */
    int of, part;      /* the contact, force, rope or closure; the component of a tyre, the last end of a rope */
    int body;
    int pairs;
} kmp_placed_force;

/** A place and a force, in ground axes. */
enum { KMP_PLACED_VALUES = 6 };

/** Lists the forces of a model, in `list` unless it is NULL; their number. */
int kmp_placed_forces(const kempe_model *model, kmp_placed_force *list);

/** KMP_PLACED_VALUES of each pair, in `out`. The tree has reactions. */
void kmp_placed_force_find(const kmp_tree *tree, const kmp_placed_force *placed, kmp_ref *out);
