/* SPDX-License-Identifier: BSD-3-Clause */
/* The row of a rigid contact: while it is held its distance stays as it was then. Otherwise the row is zero, so that it
 * is redundant. Its multiplier is the force along the normal. */
#include "constraints/kinds/kind.h"
#include "dynamics/kinematics/friction_modes.h"
#include "dynamics/kinematics/touching.h"

static void touch(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    kmp_graph *g = tree->graph;
    const kmp_force *contact = &tree->model->forces[closure->force];
    kmp_ref moved =
        kmp_sub(g, kmp_touching_gap(tree, &contact->touch), kmp_friction_input(tree, contact, KMP_ROLE_PLACE));
    h[0] = kmp_mul(g, kmp_friction_input(tree, contact, KMP_ROLE_HELD), moved);
}

const kmp_part kmp_part_touch = {1, KMP_KIND_POWER_GIVEN, touch, kmp_part_effort, NULL};
