/* SPDX-License-Identifier: BSD-3-Clause */
/* Screw: couples the slide and the rotation of a screw joint. h = slide - pitch turn/(2 pi). */
#include "constraints/kinds/kind.h"
#include <math.h>

static void residual(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    kmp_graph *g = tree->graph;
    uint32_t slide = (uint32_t)closure->motion;
    kmp_ref rate = kmp_mul(g, kmp_const(g, 1 / (8 * atan(1))), kmp_tree_number(tree, &closure->number));
    h[0] = kmp_sub(g, kmp_input(g, KMP_IN_Q, slide), kmp_mul(g, rate, kmp_input(g, KMP_IN_Q, slide + 1)));
}

const kmp_part kmp_part_screw = {1, KMP_KIND_POWER_OF_COORDINATE, residual, kmp_part_effort};
