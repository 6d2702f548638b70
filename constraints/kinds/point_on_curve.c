/* SPDX-License-Identifier: BSD-3-Clause */
/* Point on curve: each row F(x, y, z, t) stays zero for the position x, y, z of Q in the axes of P. Rows are y - f(x),
 * z - g(x), or an expression of all three. A second closure may fix the coordinates that the rows leave free. The force
 * is the sum of lambda grad F, normal to the curve; grad F is derived for symbols x, y, z, and the position then
 * replaces them. */
#include "constraints/kinds/kind_parts.h"
#include "dynamics/kinematics/kinematics_conditions.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/closure.h"
#include "symbolic/derivative.h"
#include "symbolic/substitute.h"

/* Position of Q in the axes of P. */
static void find_place(const kmp_tree *tree, const kmp_closure *closure, kmp_vec axes[3], kmp_ref place[3])
{
    kmp_vec d = kmp_part_gap(tree, closure);
    kmp_point_axes(tree, closure->point[0], kmp_part_frame(tree, closure), axes);
    for (int k = 0; k < 3; k++)
        place[k] = kmp_vec_dot(tree->graph, axes[k], d);
}

static kmp_ref row_at(const kmp_tree *tree, const kmp_closure *closure, int row, const kmp_ref place[3])
{
    kmp_tree there = *tree;
    int side = closure->curve_side[row];
    there.place = place;
    kmp_ref f = kmp_tree_bent(&there, closure->curve[row]);
    return side ? kmp_sub(tree->graph, place[side], f) : f;
}

static void residual(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    kmp_vec axes[3];
    kmp_ref place[3];
    find_place(tree, closure, axes, place);
    for (int k = 0; k < closure->curve_count; k++)
        h[k] = row_at(tree, closure, k, place);
}

/* Component k of grad F at that position. */
static kmp_ref slope(const kmp_tree *tree, const kmp_closure *closure, int row, int k, const kmp_ref place[3])
{
    static const kmp_ref one = KMP_ONE;
    kmp_graph *g = tree->graph;
    kmp_noted aside = {0}; /* conditions have their values from the row itself */
    kmp_tree symbolic = *tree;
    kmp_ref leaf[3];
    symbolic.conditions.noted = &aside;
    symbolic.conditions.settled = true; /* what stays constant along the motion is not a condition */
    for (int i = 0; i < 3; i++)
        leaf[i] = kmp_input(g, KMP_IN_PLACE, (uint32_t)i);
    kmp_ref f = row_at(&symbolic, closure, row, leaf);
    kmp_noted_free(&aside);
    kmp_derivative *d = kmp_derivative_new(g, 1, &leaf[k], &one);
    if (!d) {
        kmp_graph_fail(g);
        return KMP_ZERO;
    }
    f = kmp_derivative_of(d, f);
    kmp_derivative_free(d);
    return kmp_graph_replace(g, 3, leaf, place, f);
}

static kmp_vec load(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda)
{
    kmp_graph *g = tree->graph;
    kmp_vec axes[3], force = kmp_vec_zero();
    kmp_ref place[3];
    find_place(tree, closure, axes, place);
    for (int row = 0; row < closure->curve_count; row++)
        for (int k = 0; k < 3; k++) {
            kmp_ref along = kmp_mul(g, lambda[row], slope(tree, closure, row, k, place));
            force = kmp_vec_add(g, force, kmp_vec_scale(g, along, axes[k]));
        }
    return kmp_part_own(tree, closure, force);
}

const kmp_part kmp_part_point_on_curve = {2, KMP_KIND_POWER_GIVEN, residual, load, NULL};
