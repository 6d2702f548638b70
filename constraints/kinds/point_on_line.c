/* SPDX-License-Identifier: BSD-3-Clause */
/* Point on line: Q stays on the line through P along e1. */
#include "constraints/kinds/parts.h"

static void residual(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    kmp_part_line(tree, closure, h);
}

static kmp_vec reaction(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda)
{
    return kmp_part_line_force(tree, closure, lambda);
}

const kmp_closure_kind kmp_kind_point_on_line = {"point_on_line", 2, 1, residual, reaction, NULL, 0};
