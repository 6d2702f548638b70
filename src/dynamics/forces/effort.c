/* SPDX-License-Identifier: BSD-3-Clause */
/* An effort given as an expression. A constant one has a potential; any other counts its power. */
#include "dynamics/forces/forces.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/model.h"
#include "model/language/expression_value.h"

void kmp_law_effort(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy, kmp_ref *value)
{
    kmp_graph *g = tree->graph;
    kmp_ref effort = kmp_tree_expression(tree, force->effort);
    uint32_t k = (uint32_t)force->motion;
    *value = effort;
    kmp_apply_effort(forces, tree, force->motion, effort);
    bool conserves = kmp_expr_is_constant(force->effort);
    if (conserves && energy & KMP_ENERGY_POTENTIAL)
        forces->potential = kmp_sub(g, forces->potential, kmp_mul(g, effort, kmp_input(g, KMP_IN_Q, k)));
    if (!conserves && energy & KMP_ENERGY_POWER)
        kmp_add_power(forces, tree, effort, kmp_input(g, KMP_IN_QD, k));
}
