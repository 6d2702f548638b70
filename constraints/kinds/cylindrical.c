/* SPDX-License-Identifier: BSD-3-Clause */
/* Cylindrical: Q stays on the line through P along e1, and e2 is parallel to it. */
#include "constraints/kinds/parts.h"

static void residual(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    kmp_part_line(tree, closure, h);
    kmp_part_parallel(tree, closure, h + 2);
}

static kmp_vec reaction(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda)
{
    return kmp_part_line_force(tree, closure, lambda);
}

static kmp_vec moment(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda)
{
    return kmp_part_parallel_moment(tree, closure, lambda + 2);
}

const kmp_closure_kind kmp_kind_cylindrical = {"cylindrical", 4, 1, residual, reaction, moment, 2};
