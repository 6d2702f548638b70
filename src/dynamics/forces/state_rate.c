/* SPDX-License-Identifier: BSD-3-Clause */
/* The rate of a state on the unit inertia of its motion. It has neither potential nor power. */
#include "dynamics/forces/law.h"

void kmp_law_state_rate(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy,
                        kmp_ref *value)
{
    (void)energy;
    *value = kmp_tree_expression(tree, force->effort);
    kmp_apply_effort(forces, tree, force->motion, *value);
}
