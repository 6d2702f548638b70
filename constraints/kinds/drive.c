/* SPDX-License-Identifier: BSD-3-Clause */
/* Drive: a coordinate is a given function of time. h = q - f(t); lambda is the drive's force on the coordinate. */
#include "constraints/kinds/kind.h"

static void residual(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    kmp_graph *g = tree->graph;
    h[0] = kmp_sub(g, kmp_input(g, KMP_IN_Q, (uint32_t)closure->motion), kmp_tree_expression(tree, closure->function));
}

const kmp_part kmp_part_drive = {1, KMP_KIND_POWER_OF_COORDINATE, residual, kmp_part_effort};
