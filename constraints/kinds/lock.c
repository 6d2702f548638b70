/* SPDX-License-Identifier: BSD-3-Clause */
/* Lock: a coordinate keeps its start value; lambda is the generalized force on it. */
#include "constraints/kinds/kind.h"

static void residual(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    kmp_graph *g = tree->graph;
    kmp_ref start = kmp_tree_number(tree, &tree->model->start.q[closure->motion]);
    h[0] = kmp_sub(g, kmp_input(g, KMP_IN_Q, (uint32_t)closure->motion), start);
}

const kmp_part kmp_part_lock = {1, KMP_KIND_POWER_OF_COORDINATE, residual, kmp_part_effort};
