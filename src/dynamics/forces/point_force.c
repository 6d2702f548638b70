/* SPDX-License-Identifier: BSD-3-Clause */
/* A force at a point, components in ground axes. A constant one has the potential -F.x, any other counts F.xd. */
#include "dynamics/forces/forces.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/model.h"
#include "model/language/expression_value.h"

void kmp_law_point_force(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy,
                         kmp_ref *value)
{
    kmp_vec f;
    *value = KMP_ZERO;
    for (int i = 0; i < 3; i++)
        f.x[i] = kmp_tree_expression(tree, force->vector[i]);
    kmp_apply_at(tree, force->point[0], 0, f, forces->applied);
    /* Potential of a constant force, power of any other. */
    kmp_graph *g = tree->graph;
    bool constant = true;
    for (int i = 0; i < 3; i++)
        constant = constant && kmp_expr_is_constant(force->vector[i]);
    if (!(energy & (constant ? KMP_ENERGY_POTENTIAL : KMP_ENERGY_POWER)))
        return;
    kmp_vec x = kmp_point_position(tree, force->point[0], 0);
    if (constant) {
        forces->potential = kmp_sub(g, forces->potential, kmp_vec_dot(g, f, x));
        return;
    }
    for (int i = 0; i < 3; i++)
        x.x[i] = f.x[i] == KMP_ZERO ? KMP_ZERO : x.x[i];
    x = kmp_vec_rate(tree, x);
    for (int i = 0; i < 3; i++)
        kmp_add_power(forces, tree, f.x[i], x.x[i]);
}
