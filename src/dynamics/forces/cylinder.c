/* SPDX-License-Identifier: BSD-3-Clause */
/* A hydraulic or pneumatic cylinder between two points. The pressure p on the whole piston (bore D) pushes the points
 * apart, the pressure r on the side of the rod (diameter d) pulls them together: thrust = pi/4 (p D^2 - r (D^2 - d^2)).
 */
#include "dynamics/forces/line.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/model.h"
#include "model/language/expression_value.h"

void kmp_law_cylinder(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy, kmp_ref *value)
{
    kmp_graph *g = tree->graph;
    kmp_ref bore = kmp_tree_number(tree, &force->bore), rod = kmp_tree_number(tree, &force->rod);
    kmp_ref whole = kmp_mul(g, bore, bore), thrust;
    thrust = kmp_mul(g, whole, kmp_tree_expression(tree, force->vector[0]));
    bool constant = kmp_expr_is_constant(force->vector[0]);
    if (force->vector[1]) {
        kmp_ref ring = kmp_sub(g, whole, kmp_mul(g, rod, rod));
        thrust = kmp_sub(g, thrust, kmp_mul(g, ring, kmp_tree_expression(tree, force->vector[1])));
        constant = constant && kmp_expr_is_constant(force->vector[1]);
    }
    *value = kmp_mul(g, kmp_const(g, 0.78539816339744830962), thrust); /* pi/4 */
    kmp_pull_along(forces, tree, force, kmp_neg(*value), constant, energy);
}
