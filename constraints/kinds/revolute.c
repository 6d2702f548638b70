/* SPDX-License-Identifier: BSD-3-Clause */
/* Revolute: the points coincide and the axes are parallel (a cut hinge). lambda 1-3 is the force on Q's body, 4 and 5
 * its moments across the axis. */
#include "constraints/kinds/parts.h"

static void residual(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    kmp_part_ball(tree, closure, h);
    kmp_part_parallel(tree, closure, h + 3);
}

static kmp_vec reaction(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda)
{
    (void)tree, (void)closure;
    return (kmp_vec){{lambda[0], lambda[1], lambda[2]}};
}

static kmp_vec moment(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda)
{
    return kmp_part_parallel_moment(tree, closure, lambda + 3);
}

const kmp_closure_kind kmp_kind_revolute = {"revolute", 5, 1, residual, reaction, moment, 2};
