/* SPDX-License-Identifier: BSD-3-Clause */
/* Spring-damper in a joint: effort -k (q - rest) - c qd, potential k (q - rest)^2 / 2, power -c qd^2. */
#include "dynamics/forces/forces.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/model.h"

void kmp_law_joint_spring(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy,
                          kmp_ref *value)
{
    kmp_graph *g = tree->graph;
    kmp_ref q = kmp_input(g, KMP_IN_Q, (uint32_t)force->motion), qd = kmp_input(g, KMP_IN_QD, (uint32_t)force->motion);
    kmp_ref stretch = kmp_sub(g, q, kmp_tree_number(tree, &force->rest));
    kmp_ref pull = kmp_mul(g, kmp_tree_number(tree, &force->stiffness), stretch);
    kmp_ref drag = kmp_mul(g, kmp_tree_number(tree, &force->damping), qd);
    *value = kmp_neg(kmp_add(g, pull, drag));
    kmp_apply_effort(forces, tree, force->motion, *value);
    if (energy & KMP_ENERGY_POTENTIAL) {
        kmp_ref work = kmp_mul(g, kmp_const(g, 0.5), kmp_mul(g, pull, stretch));
        forces->potential = kmp_add(g, forces->potential, work);
    }
    if (energy & KMP_ENERGY_POWER)
        kmp_add_power(forces, tree, kmp_neg(drag), qd);
}
