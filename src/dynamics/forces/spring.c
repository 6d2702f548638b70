/* SPDX-License-Identifier: BSD-3-Clause */
/* The law of a spring and damper between two points, with the tension k (L - L0) + c Ld. With d from the first point to
 * the second and Ld = d.dd / L the force on the first point is (k - k L0 / L + c d.dd / L^2) d. Points at a constant
 * distance have a tension, too. */
#include "dynamics/forces/forces.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/model.h"
#include "symbolic/function_table.h"

void kmp_law_spring(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy, kmp_ref *value)
{
    kmp_graph *g = tree->graph;
    int frame;
    kmp_vec d = kmp_point_difference(tree, force->point[0], force->point[1], &frame);
    kmp_ref k = kmp_tree_number(tree, &force->stiffness), c = kmp_tree_number(tree, &force->damping);
    kmp_ref free_length = kmp_tree_number(tree, &force->free_length);
    kmp_ref square = kmp_vec_dot(g, d, d), length = kmp_sqrt(g, square), ratio;
    kmp_ref stretch = kmp_sub(g, length, free_length), tension = kmp_mul(g, k, stretch);
    ratio = kmp_sub(g, k, kmp_div(g, kmp_mul(g, k, free_length), length));
    if (c != KMP_ZERO) {
        kmp_ref rate = kmp_vec_dot(g, d, kmp_vec_rate(tree, d)); /* L Ld */
        kmp_ref damping = kmp_mul(g, c, kmp_div(g, rate, square));
        ratio = kmp_add(g, ratio, damping);
        if (rate != KMP_ZERO)
            tension = kmp_add(g, tension, kmp_mul(g, c, kmp_div(g, rate, length)));
        if (energy & KMP_ENERGY_POWER)
            forces->power = kmp_sub(g, forces->power, kmp_mul(g, damping, rate));
    }
    *value = tension;
    kmp_apply_between(forces, tree, force->point, frame, kmp_vec_scale(g, ratio, d));
    if (energy & KMP_ENERGY_POTENTIAL) {
        kmp_ref work = kmp_mul(g, kmp_mul(g, kmp_const(g, 0.5), k), kmp_mul(g, stretch, stretch));
        forces->potential = kmp_add(g, forces->potential, work);
    }
}
