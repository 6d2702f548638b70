/* SPDX-License-Identifier: BSD-3-Clause */
/* Ball: two points coincide. h = Q - P in the axes of the nearest common ancestor; lambda is the force on Q's body. */
#include "constraints/kinds/kind.h"

static void residual(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h, int *frame)
{
    kmp_vec d = kmp_point_difference(tree, closure->point[0], closure->point[1], frame);
    for (int k = 0; k < 3; k++)
        h[k] = d.x[k];
}

static kmp_vec reaction(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda)
{
    (void)tree, (void)closure;
    return (kmp_vec){{lambda[0], lambda[1], lambda[2]}};
}

const kmp_closure_kind kmp_kind_ball = {"ball", 3, 1, residual, reaction, NULL, 0};
