/* SPDX-License-Identifier: BSD-3-Clause */
/* The row of a friction element that sticks: while it is held its place stays where it was then, or, without a place,
 * its rate is zero. The row of a rigid contact: while it is held its distance stays as it was then; its multiplier is
 * the force along the normal. Otherwise both rows are zero, so that they are redundant; evaluated in place they always
 * are. */
#include "constraints/kinds/kind.h"
#include "dynamics/kinematics/friction_modes.h"
#include "dynamics/kinematics/link_tree.h"
#include "dynamics/kinematics/touching.h"
#include "model/data/force.h"

static void friction(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    kmp_graph *g = tree->graph;
    const kmp_force *force = kmp_model_force(tree->model, closure->force);
    h[0] = kmp_mul(g, kmp_friction_input(tree, force, KMP_ROLE_HELD), kmp_friction_moved(tree, force));
}

static bool rolling(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *rates)
{
    kmp_graph *g = tree->graph;
    const kmp_force *force = kmp_model_force(tree->model, closure->force);
    if (kmp_friction_has_place(tree, force))
        return false;
    rates[0] = kmp_mul(g, kmp_friction_input(tree, force, KMP_ROLE_HELD), kmp_friction_rate(tree, force));
    return true;
}

const kmp_part kmp_part_friction = {1, KMP_KIND_POWER_GIVEN, friction, kmp_part_effort, rolling};

static void touch(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    kmp_graph *g = tree->graph;
    const kmp_force *contact = kmp_model_force(tree->model, closure->force);
    kmp_ref moved =
        kmp_sub(g, kmp_touching_gap(tree, &contact->touch), kmp_friction_input(tree, contact, KMP_ROLE_PLACE));
    h[0] = kmp_mul(g, kmp_friction_input(tree, contact, KMP_ROLE_HELD), moved);
}

const kmp_part kmp_part_touch = {1, KMP_KIND_POWER_GIVEN, touch, kmp_part_effort, NULL};
