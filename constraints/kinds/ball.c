/* SPDX-License-Identifier: BSD-3-Clause */
/* Ball: two points coincide. h = Q - P in the axes of the nearest common ancestor; lambda is the force on Q's body. */
#include "constraints/kinds/parts.h"

static void residual(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    kmp_part_ball(tree, closure, h);
}

static kmp_vec reaction(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda)
{
    (void)tree, (void)closure;
    return (kmp_vec){{lambda[0], lambda[1], lambda[2]}};
}

const kmp_closure_kind kmp_kind_ball = {"ball", 3, 1, residual, reaction, NULL, 0};
