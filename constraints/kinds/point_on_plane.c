/* SPDX-License-Identifier: BSD-3-Clause */
/* Point on plane: Q stays in the plane through P that is normal to e1. h = e1.d; lambda is the force along e1. */
#include "constraints/kinds/parts.h"

static void residual(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    kmp_vec axes[3], d = kmp_part_gap(tree, closure);
    kmp_part_axes(tree, closure, 0, axes);
    h[0] = kmp_vec_dot(tree->graph, axes[0], d);
}

static kmp_vec reaction(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda)
{
    kmp_vec axes[3];
    kmp_part_axes(tree, closure, 0, axes);
    return kmp_part_own(tree, closure, kmp_vec_scale(tree->graph, lambda[0], axes[0]));
}

const kmp_closure_kind kmp_kind_point_on_plane = {"point_on_plane", 1, 1, residual, reaction, NULL, 0};
