/* SPDX-License-Identifier: BSD-3-Clause */
/* Point on curve: in the axes of P, Q stays on y = f(x), a table; z is free (a second closure may bind it).
 * h = y - f(x); the force is lambda (y - f' x), normal to the curve. */
#include "constraints/kinds/parts.h"
#include "symbolic/table.h"

/* Q in the axes of P. */
static int place(const kmp_tree *tree, const kmp_closure *closure, kmp_vec axes[3], kmp_ref *x, kmp_ref *y)
{
    int frame;
    kmp_vec d = kmp_point_difference(tree, closure->point[0], closure->point[1], &frame);
    kmp_point_axes(tree, closure->point[0], frame, axes);
    *x = kmp_vec_dot(tree->graph, axes[0], d);
    *y = kmp_vec_dot(tree->graph, axes[1], d);
    return frame;
}

/* f, or with `order` 1 its slope. */
static kmp_ref curve(const kmp_tree *tree, const kmp_closure *closure, int order, kmp_ref x)
{
    int table = kmp_graph_add_table(tree->graph, closure->table->table);
    return table < 0 ? KMP_ZERO : kmp_table_derivative_at(tree->graph, table, order, x);
}

static void residual(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h, int *frame)
{
    kmp_vec axes[3];
    kmp_ref x, y;
    *frame = place(tree, closure, axes, &x, &y);
    h[0] = kmp_sub(tree->graph, y, curve(tree, closure, 0, x));
}

static kmp_vec reaction(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda)
{
    kmp_graph *g = tree->graph;
    kmp_vec axes[3];
    kmp_ref x, y;
    (void)place(tree, closure, axes, &x, &y);
    kmp_ref slope = curve(tree, closure, 1, x);
    kmp_vec normal = kmp_vec_sub(g, axes[1], kmp_vec_scale(g, slope, axes[0]));
    return kmp_vec_scale(g, lambda[0], normal);
}

const kmp_closure_kind kmp_kind_point_on_curve = {"point_on_curve", 1, 1, residual, reaction, NULL, 0};
