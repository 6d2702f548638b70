/* SPDX-License-Identifier: BSD-3-Clause */
/* Smooth end stops. With x = q - upper (or lower - q) and the width w,
 *
 *     p(x) = (x + sqrt(x^2 + w^2)) / 2        x far beyond the stop, w^2 / (4 |x|) far before it
 *     p'   = p / sqrt(x^2 + w^2)              from 0 to 1
 *     push back = k p p' + c p'^2 xd          potential k p^2 / 2, power -c (p' xd)^2
 *
 * which is k x + c xd deep in the stop, k w / 4 + c xd / 4 on it, and falls as k w^4 / (16 |x|^3) before it. All
 * derivatives exist everywhere. */
#include "dynamics/forces/forces.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/model.h"
#include "symbolic/function_table.h"

/* The effort of one end. */
static kmp_ref stop(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, const kmp_number *end, bool upper,
                    unsigned energy)
{
    kmp_graph *g = tree->graph;
    kmp_ref half = kmp_const(g, 0.5), w = kmp_tree_number(tree, &force->width);
    kmp_ref k = kmp_tree_number(tree, &force->stiffness), c = kmp_tree_number(tree, &force->damping);
    kmp_ref x = kmp_sub(g, kmp_input(g, KMP_IN_Q, (uint32_t)force->motion), kmp_tree_number(tree, end));
    kmp_ref xd = kmp_input(g, KMP_IN_QD, (uint32_t)force->motion);
    if (!upper) {
        x = kmp_neg(x);
        xd = kmp_neg(xd);
    }
    kmp_ref root = kmp_sqrt(g, kmp_add(g, kmp_mul(g, x, x), kmp_mul(g, w, w)));
    kmp_ref p = kmp_mul(g, half, kmp_add(g, x, root)), slope = kmp_div(g, p, root);
    kmp_ref kp = kmp_mul(g, k, p), drag = kmp_mul(g, c, kmp_mul(g, kmp_mul(g, slope, slope), xd));
    kmp_ref push = kmp_add(g, kmp_mul(g, kp, slope), drag);
    if (energy & KMP_ENERGY_POTENTIAL)
        forces->potential = kmp_add(g, forces->potential, kmp_mul(g, half, kmp_mul(g, kp, p)));
    if (energy & KMP_ENERGY_POWER)
        kmp_add_power(forces, tree, kmp_neg(drag), xd);
    return upper ? kmp_neg(push) : push;
}

void kmp_law_stops(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy, kmp_ref *value)
{
    *value = KMP_ZERO;
    if (force->has_lower)
        *value = stop(forces, tree, force, &force->lower, false, energy);
    if (force->has_upper)
        *value = kmp_add(tree->graph, *value, stop(forces, tree, force, &force->upper, true, energy));
    kmp_apply_effort(forces, tree, force->motion, *value);
}
