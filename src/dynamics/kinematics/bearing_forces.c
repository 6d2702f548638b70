/* SPDX-License-Identifier: BSD-3-Clause */
/* Bearings at z1 and z2 along the axis a, with radial forces A and B, carry the force F = A + B + (a.F) a and the
 * moment about the first one M1 = (z2 - z1) a x B, so that B = M1 x a / (z2 - z1). */
#include "dynamics/kinematics/bearing_forces.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "model/data/body.h"
#include "model/data/closure.h"

/* As the model gives it, in ground axes. */
static kmp_vec axis_of(const kmp_tree *tree, const kmp_bearing_pair *pair)
{
    const kempe_model *model = tree->model;
    if (pair->closure >= 0) {
        const kmp_closure *closure = kmp_model_closure(model, pair->closure);
        return kmp_point_direction(tree, closure->point[0], closure->axis[0], 0);
    }
    const int link = tree->of_motion[kmp_pin_motion(model, pair->body)];
    const bool against = tree->links[link].reversed != kmp_model_body(model, pair->body)->reversed;
    const kmp_vec e = kmp_vec_axis(against ? kmp_neg(KMP_ONE) : KMP_ONE, tree->links[link].axis);
    return kmp_link_direction(tree, link, e, 0);
}

void kmp_bearing_forces(const kmp_tree *tree, const kmp_bearing_pair *pair, kmp_vec force, kmp_vec moment,
                        kmp_ref values[KMP_BEARING_VALUES])
{
    kmp_graph *g = tree->graph;
    const kmp_vec axis = axis_of(tree, pair);
    const kmp_ref first = kmp_tree_number(tree, &pair->at[0]), second = kmp_tree_number(tree, &pair->at[1]);
    const kmp_ref axial = kmp_vec_dot(g, axis, force), span = kmp_sub(g, second, first);
    const kmp_vec about_first = kmp_vec_sub(g, moment, kmp_vec_scale(g, first, kmp_vec_cross(g, axis, force)));
    const kmp_vec b = kmp_vec_scale(g, kmp_div(g, KMP_ONE, span), kmp_vec_cross(g, about_first, axis));
    const kmp_vec across = kmp_vec_sub(g, force, kmp_vec_scale(g, axial, axis));
    const kmp_vec a = kmp_vec_sub(g, across, b);
    for (int k = 0; k < 3; k++) {
        values[k] = a.x[k];
        values[3 + k] = b.x[k];
    }
    values[6] = axial;
}

void kmp_bearing_reactions(const kmp_tree *tree, const kmp_bearing_pair *pair, kmp_ref values[KMP_BEARING_VALUES])
{
    const kmp_tree_reactions *by = &tree->reactions;
    kmp_vec load[2] = {kmp_vec_zero(), kmp_vec_zero()};
    for (int moment = 0; moment < 2; moment++)
        if (pair->closure >= 0 && by->of_closure)
            load[moment] = by->of_closure(tree, pair->closure, moment == 1);
        else if (pair->closure < 0 && by->joints)
            load[moment] = by->of_joint(tree, pair->body, moment == 1);
    kmp_bearing_forces(tree, pair, load[0], load[1], values);
}
