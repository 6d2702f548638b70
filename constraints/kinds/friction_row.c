/* SPDX-License-Identifier: BSD-3-Clause */
/* The row of a friction element that sticks: while it is held its place stays where it was then, or, without a place,
 * its rate is zero. Otherwise the row is
 * zero, so that it is redundant; evaluated in place it is always zero. */
#include "constraints/kinds/kind.h"
#include "dynamics/kinematics/friction_modes.h"

static void friction(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    kmp_graph *g = tree->graph;
    const kmp_force *force = &tree->model->forces[closure->force];
    h[0] = kmp_mul(g, kmp_friction_input(tree, force, KMP_ROLE_HELD), kmp_friction_moved(tree, force));
}

static bool rolling(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *rates)
{
    kmp_graph *g = tree->graph;
    const kmp_force *force = &tree->model->forces[closure->force];
    if (kmp_friction_has_place(tree, force))
        return false;
    rates[0] = kmp_mul(g, kmp_friction_input(tree, force, KMP_ROLE_HELD), kmp_friction_rate(tree, force));
    return true;
}

const kmp_part kmp_part_friction = {1, KMP_KIND_POWER_GIVEN, friction, kmp_part_effort, rolling};
