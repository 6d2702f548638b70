/* SPDX-License-Identifier: BSD-3-Clause */
/* Weld: the points coincide and their axes are parallel (a cut through a body). */
#include "constraints/kinds/parts.h"

static void residual(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    kmp_part_ball(tree, closure, h);
    kmp_part_aligned(tree, closure, h + 3);
}

static kmp_vec reaction(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda)
{
    (void)tree, (void)closure;
    return (kmp_vec){{lambda[0], lambda[1], lambda[2]}};
}

static kmp_vec moment(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda)
{
    return kmp_part_aligned_moment(tree, closure, lambda + 3);
}

const kmp_closure_kind kmp_kind_weld = {"weld", 6, 1, residual, reaction, moment, 3};
