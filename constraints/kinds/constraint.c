/* SPDX-License-Identifier: BSD-3-Clause */
/* Constraint: an expression of the coordinates and time stays zero. */
#include "constraints/kinds/kind.h"

static void residual(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    h[0] = kmp_tree_expression(tree, closure->function);
}

static kmp_vec reaction(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda)
{
    (void)tree, (void)closure;
    return (kmp_vec){{lambda[0], KMP_ZERO, KMP_ZERO}};
}

const kmp_closure_kind kmp_kind_constraint = {"constraint", 1, KMP_KIND_POWER_GIVEN, residual, reaction, NULL, 0};
