/* SPDX-License-Identifier: BSD-3-Clause */
/* Dry friction in a joint. With a speed s it is regularised: effort -F qd / sqrt(qd^2 + s^2). It is the level F at
 * speeds far beyond s and viscous, -F/s qd, far below it. There is no sticking: a load below F creeps at about s load /
 * F. Otherwise it sticks (dynamics/kinematics/friction_modes.h): the effort here is that of slip, and in stick the row
 * of a closure has it. */
#include "dynamics/forces/forces.h"
#include "dynamics/kinematics/friction_modes.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/model.h"
#include "symbolic/function_table.h"
#include "symbolic/partials.h"

/* On the coordinate, or on all that the place, or the rate, depends on. */
static void apply(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, kmp_ref effort)
{
    kmp_ref of;
    kmp_input_kind by = kmp_friction_slopes_of(tree, force, &of);
    int count = kmp_friction_is_along(force) ? tree->count - 1 : 0;
    kmp_ref *slope = KMP_GRAPH_NEW(tree->graph, kmp_ref, count);
    if (count == 0)
        kmp_apply_effort(forces, tree, force->motion, effort);
    if (slope && count > 0)
        kmp_partials_all(tree->graph, 1, &of, by, count, slope);
    for (int k = 0; slope && k < count; k++)
        if (slope[k] != KMP_ZERO)
            kmp_apply_effort(forces, tree, k, kmp_mul(tree->graph, slope[k], effort));
}

/* The value of the output is the multiplier of the element's row: a run puts the friction of every mode there. If modes
 * are the only inputs of conditions, there is no run. The static level has no part in the effort, but its conditions
 * are among those of the law. */
static void stick_and_slip(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy,
                           kmp_ref *value)
{
    kmp_graph *g = tree->graph;
    kmp_ref slip = kmp_mul(g, kmp_friction_sense(tree, force), kmp_friction_level(tree, force));
    kmp_ref effort = kmp_sub(g, kmp_friction_input(tree, force, KMP_ROLE_GIVEN), slip);
    *value = tree->settled ? kmp_friction_force(tree, force) : kmp_tree_multiplier(tree, force->closure, 0);
    (void)kmp_friction_value(tree, &(kmp_condition){.of = force, .role = KMP_ROLE_STATIC});
    apply(forces, tree, force, effort);
    if (energy & KMP_ENERGY_POWER)
        kmp_add_power(forces, tree, effort, kmp_friction_rate(tree, force));
}

void kmp_law_friction(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy, kmp_ref *value)
{
    kmp_graph *g = tree->graph;
    if (kmp_force_sticks(force)) {
        stick_and_slip(forces, tree, force, energy, value);
        return;
    }
    kmp_ref qd = kmp_friction_rate(tree, force), s = kmp_tree_number(tree, &force->speed);
    kmp_ref level = kmp_friction_level(tree, force);
    kmp_ref root = kmp_sqrt(g, kmp_add(g, kmp_mul(g, qd, qd), kmp_mul(g, s, s)));
    *value = kmp_neg(kmp_mul(g, level, kmp_div(g, qd, root)));
    apply(forces, tree, force, *value);
    if (energy & KMP_ENERGY_POWER)
        kmp_add_power(forces, tree, *value, qd);
}
