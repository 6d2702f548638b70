/* SPDX-License-Identifier: BSD-3-Clause */
/* Constraint: an expression of the coordinates and time stays zero. */
#include "constraints/kinds/kind.h"

static void residual(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    h[0] = kmp_tree_expression(tree, closure->function);
}

const kmp_part kmp_part_constraint = {1, KMP_KIND_POWER_GIVEN, residual, kmp_part_effort};
