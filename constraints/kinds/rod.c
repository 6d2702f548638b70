/* SPDX-License-Identifier: BSD-3-Clause */
/* Rod: the distance of two points is constant or a function of time. h = (d.d - L^2) / 2 with d = Q - P, smooth for
 * every d; lambda d is the force on Q's body. */
#include "constraints/kinds/kind_parts.h"

static void residual(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    kmp_graph *g = tree->graph;
    kmp_vec d = kmp_part_gap(tree, closure);
    kmp_ref half = kmp_const(g, 0.5);
    kmp_ref length =
        closure->function ? kmp_tree_bent(tree, closure->function) : kmp_tree_number(tree, &closure->number);
    h[0] = kmp_mul(g, half, kmp_sub(g, kmp_vec_dot(g, d, d), kmp_mul(g, length, length)));
}

static kmp_vec load(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda)
{
    kmp_vec d = kmp_part_gap(tree, closure);
    return kmp_part_own(tree, closure, kmp_vec_scale(tree->graph, lambda[0], d));
}

const kmp_part kmp_part_rod = {1, 2, residual, load, NULL};
