/* SPDX-License-Identifier: BSD-3-Clause */
/* Coupler: a sum of coordinates times factors keeps its value (gears, rack and pinion, a differential). lambda times a
 * factor is the generalized force on its coordinate. */
#include "constraints/kinds/kind.h"

static void residual(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    kmp_graph *g = tree->graph;
    const kmp_number *start = tree->model->start.q;
    h[0] = closure->constant ? kmp_neg(kmp_tree_number(tree, closure->constant)) : KMP_ZERO;
    for (int k = 0; k < closure->term_count; k++) {
        const kmp_term *term = &closure->terms[k];
        kmp_ref q = kmp_input(g, KMP_IN_Q, (uint32_t)term->motion);
        if (!closure->constant)
            q = kmp_sub(g, q, kmp_tree_number(tree, &start[term->motion]));
        h[0] = kmp_add(g, h[0], kmp_mul(g, kmp_tree_number(tree, &term->factor), q));
    }
}

const kmp_part kmp_part_coupler = {1, KMP_KIND_POWER_OF_COORDINATE, residual, kmp_part_effort};
