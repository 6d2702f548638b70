/* SPDX-License-Identifier: BSD-3-Clause */
/* A torque on a body, components in ground axes. Its power is counted: a constant torque has no potential in space. */
#include "dynamics/forces/law.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/model.h"

void kmp_law_body_torque(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy,
                         kmp_ref *value)
{
    kmp_graph *g = tree->graph;
    int link = tree->mounts[force->body].link;
    kmp_vec torque;
    *value = KMP_ZERO;
    for (int i = 0; i < 3; i++)
        torque.x[i] = kmp_tree_expression(tree, force->vector[i]);
    kmp_wrench *applied = &forces->applied[link];
    applied->moment = kmp_vec_add(g, applied->moment, kmp_from_ancestor(tree, link, 0, torque));
    if (energy & KMP_ENERGY_POWER)
        forces->power = kmp_add(g, forces->power, kmp_vec_dot(g, torque, kmp_link_spin(tree, link, 0)));
}
