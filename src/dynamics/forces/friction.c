/* SPDX-License-Identifier: BSD-3-Clause */
/* Regularised dry friction in a joint: effort -F qd / sqrt(qd^2 + s^2). It is the level F at speeds far beyond s and
 * viscous, -F/s qd, far below it. There is no sticking: a load below F creeps at about s load / F. */
#include "dynamics/forces/law.h"

void kmp_law_friction(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy, kmp_ref *value)
{
    kmp_graph *g = tree->graph;
    kmp_ref qd = kmp_input(g, KMP_IN_QD, (uint32_t)force->motion), s = kmp_tree_number(tree, &force->speed);
    kmp_ref level = kmp_tree_number(tree, &force->level);
    kmp_ref root = kmp_sqrt(g, kmp_add(g, kmp_mul(g, qd, qd), kmp_mul(g, s, s)));
    *value = kmp_neg(kmp_mul(g, level, kmp_div(g, qd, root)));
    kmp_apply_effort(forces, tree, force->motion, *value);
    if (energy & KMP_ENERGY_POWER)
        kmp_add_power(forces, tree, *value, qd);
}
