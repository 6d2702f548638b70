/* SPDX-License-Identifier: BSD-3-Clause */
/* The rate of a state on the unit inertia of its motion. It has neither potential nor power. A delayed signal that the
 * caller sets has no rate. */
#include "dynamics/forces/forces.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/model.h"

void kmp_law_state_rate(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy,
                        kmp_ref *value)
{
    const kmp_state *state = kmp_state_of(tree->model, force->motion);
    (void)energy;
    *value = tree->given_delays && state->delayed ? KMP_ZERO : kmp_tree_expression(tree, force->effort);
    kmp_apply_effort(forces, tree, force->motion, *value);
}
