/* SPDX-License-Identifier: BSD-3-Clause */
/* A rigid contact. Its force is the multiplier of its row; where the rows of others keep it closed it is given, and
 * applied here. The value of the output is the multiplier: a run puts the force of every mode there. */
#include "dynamics/forces/forces.h"
#include "dynamics/kinematics/friction_modes.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/link_tree.h"
#include "dynamics/kinematics/touching.h"
#include "model/data/model.h"
#include "symbolic/function_table.h"

void kmp_law_touch(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy, kmp_ref *value)
{
    kmp_graph *g = tree->graph;
    kmp_ref given = kmp_friction_input(tree, force, KMP_ROLE_GIVEN), *slope = KMP_GRAPH_NEW(g, kmp_ref, tree->count);
    value[0] = kmp_tree_multiplier(tree, force->closure, 0);
    /* The place of its centre in the bearing. */
    kmp_ref square = KMP_ZERO;
    for (int k = 0; k < 3 && force->touch.clearance && force->vector[k]; k++) {
        kmp_ref x = kmp_tree_expression(tree, force->vector[k]);
        square = kmp_add(g, square, kmp_mul(g, x, x));
        if (k < 2)
            value[1 + k] = x;
    }
    if (force->touch.clearance)
        value[3] = kmp_sqrt(g, square);
    if (!slope)
        return;
    kmp_touching_slopes(tree, &force->touch, slope);
    for (int k = 0; k < tree->count - 1; k++) {
        if (slope[k] == KMP_ZERO)
            continue;
        kmp_ref effort = kmp_mul(g, slope[k], given);
        kmp_apply_effort(forces, tree, k, effort);
        if (energy & KMP_ENERGY_POWER)
            kmp_add_power(forces, tree, effort, kmp_input(g, KMP_IN_QD, (uint32_t)k));
    }
}
