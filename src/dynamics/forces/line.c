/* SPDX-License-Identifier: BSD-3-Clause */
/* A force along the line between two points, by an expression of any quantities. With d from the first point to the
 * second and the tension T, the force on the first point is T d / |d|; its power is -T times the rate of |d|. */
#include "dynamics/forces/law.h"

void kmp_pull_along(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, kmp_ref tension, bool constant,
                    unsigned energy)
{
    kmp_graph *g = tree->graph;
    int frame;
    kmp_vec d = kmp_point_difference(tree, force->point[0], force->point[1], &frame);
    kmp_ref length = kmp_sqrt(g, kmp_vec_dot(g, d, d));
    kmp_apply_between(forces, tree, force->point, frame, kmp_vec_scale(g, kmp_div(g, tension, length), d));
    if (constant && energy & KMP_ENERGY_POTENTIAL)
        forces->potential = kmp_add(g, forces->potential, kmp_mul(g, tension, length));
    if (!constant && energy & KMP_ENERGY_POWER)
        kmp_add_power(forces, tree, kmp_neg(tension), kmp_point_approach(tree, force->point[0], force->point[1]));
}

void kmp_law_line(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy, kmp_ref *value)
{
    *value = kmp_tree_expression(tree, force->effort);
    kmp_pull_along(forces, tree, force, *value, kmp_expr_is_constant(force->effort), energy);
}
