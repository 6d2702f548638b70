/* SPDX-License-Identifier: BSD-3-Clause */
/* Universal: the points coincide and the axis of the first is perpendicular to that of the second (a cut Cardan joint).
 * h4 = e1.e2. */
#include "constraints/kinds/parts.h"

static void residual(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    kmp_vec first[3], second[3];
    kmp_part_ball(tree, closure, h);
    kmp_part_axes(tree, closure, 0, first);
    kmp_part_axes(tree, closure, 1, second);
    h[3] = kmp_vec_dot(tree->graph, first[0], second[0]);
}

static kmp_vec reaction(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda)
{
    (void)tree, (void)closure;
    return (kmp_vec){{lambda[0], lambda[1], lambda[2]}};
}

static kmp_vec moment(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda)
{
    kmp_vec first[3], second[3];
    kmp_part_axes(tree, closure, 0, first);
    kmp_part_axes(tree, closure, 1, second);
    kmp_vec across = kmp_vec_cross(tree->graph, second[0], first[0]);
    return kmp_part_own(tree, closure, kmp_vec_scale(tree->graph, lambda[3], across));
}

const kmp_closure_kind kmp_kind_universal = {"universal", 4, 1, residual, reaction, moment, 1};
