/* SPDX-License-Identifier: BSD-3-Clause */
/* A torque between two bodies about an axis w of the first point, by an expression of any quantities: T w on the first
 * body and -T w on the second, so that a positive T resists a growing angle, as a tension resists a growing distance.
 * Its power is -T times the component along w of the relative angular velocity. */
#include "dynamics/forces/forces.h"
#include "dynamics/kinematics/kinematics_measures.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/model.h"

void kmp_law_torsion(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy, kmp_ref *value)
{
    kmp_graph *g = tree->graph;
    const int *point = force->point;
    const double e[3] = {force->axis == 0, force->axis == 1, force->axis == 2};
    int frame = kmp_tree_common(tree, kmp_point_link(tree, point[0]), kmp_point_link(tree, point[1]));
    *value = kmp_tree_expression(tree, force->effort);
    kmp_vec moment = kmp_vec_scale(g, *value, kmp_point_direction(tree, point[0], e, frame));
    kmp_apply_moment(forces, tree, point[0], frame, moment);
    kmp_apply_moment(forces, tree, point[1], frame, kmp_vec_sub(g, kmp_vec_zero(), moment));
    if (energy & KMP_ENERGY_POWER) {
        kmp_vec turning = kmp_point_measure(tree, KMP_MEASURE_ANGULAR_VELOCITY, point[1], point[0]);
        kmp_add_power(forces, tree, kmp_neg(*value), turning.x[force->axis]);
    }
}
