/* SPDX-License-Identifier: BSD-3-Clause */
/* A force along the line between two points, by an expression of any quantities. With d from the first point to the
 * second and the tension T, the force on the first point is T d / |d|; its power is -T times the rate of |d|. A rope
 * runs through further points without friction: it has one tension, and the sum of its parts is its length. */
#include "dynamics/forces/line.h"
#include "dynamics/forces/forces.h"
#include "dynamics/kinematics/kinematics_measures.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/force_table.h"
#include "model/data/model.h"
#include "model/language/expression_value.h"
#include "symbolic/function_table.h"

void kmp_pull_along(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, kmp_ref tension, bool constant,
                    unsigned energy)
{
    kmp_graph *g = tree->graph;
    kmp_ref whole = KMP_ZERO, rate = KMP_ZERO;
    bool power = !constant && energy & KMP_ENERGY_POWER;
    for (int k = 0; k <= force->through_count; k++) {
        const int point[2] = {kmp_force_point(force, k), kmp_force_point(force, k + 1)};
        int frame;
        kmp_vec d = kmp_point_difference(tree, point[0], point[1], &frame);
        kmp_ref length = kmp_sqrt(g, kmp_vec_dot(g, d, d));
        kmp_apply_between(forces, tree, point, frame, kmp_vec_scale(g, kmp_div(g, tension, length), d));
        whole = kmp_add(g, whole, length);
        if (power)
            rate = kmp_add(g, rate, kmp_point_approach(tree, point[0], point[1]));
    }
    if (constant && energy & KMP_ENERGY_POTENTIAL)
        forces->potential = kmp_add(g, forces->potential, kmp_mul(g, tension, whole));
    if (power)
        kmp_add_power(forces, tree, kmp_neg(tension), rate);
}

void kmp_law_line(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy, kmp_ref *value)
{
    *value = kmp_tree_expression(tree, force->effort);
    kmp_pull_along(forces, tree, force, *value, kmp_expr_is_constant(force->effort), energy);
}
