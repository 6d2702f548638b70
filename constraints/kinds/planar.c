/* SPDX-License-Identifier: BSD-3-Clause */
/* Planar: Q stays in the plane through P that is normal to e1, and e2 is parallel to e1 (a cut planar joint). lambda 1
 * is the force along e1, 2 and 3 are moments across it. */
#include "constraints/kinds/parts.h"

static void residual(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    kmp_vec axes[3], d = kmp_part_gap(tree, closure);
    kmp_part_axes(tree, closure, 0, axes);
    h[0] = kmp_vec_dot(tree->graph, axes[0], d);
    kmp_part_parallel(tree, closure, h + 1);
}

static kmp_vec reaction(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda)
{
    kmp_vec axes[3];
    kmp_part_axes(tree, closure, 0, axes);
    return kmp_part_own(tree, closure, kmp_vec_scale(tree->graph, lambda[0], axes[0]));
}

static kmp_vec moment(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda)
{
    return kmp_part_parallel_moment(tree, closure, lambda + 1);
}

const kmp_closure_kind kmp_kind_planar = {"planar", 3, 1, residual, reaction, moment, 2};
