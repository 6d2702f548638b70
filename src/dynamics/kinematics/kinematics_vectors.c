/* SPDX-License-Identifier: BSD-3-Clause */
/* Vectors, tensors and matrices from the axes of one link in those of another, and the path between links. */
#include "dynamics/kinematics/link_tree.h"
#include "symbolic/rotation.h"

kmp_ref kmp_link_axes(const kmp_tree *tree, int i, int row, int column)
{
    const kmp_link *link = &tree->links[i];
    if (link->before >= 0 || tree->links[link->parent].after >= 0)
        return link->chart[row][column];
    return kmp_const(tree->graph, link->g[row][column]);
}

/* g of v_parent = g v_link. */
static kmp_matrix link_matrix(const kmp_tree *tree, int i)
{
    kmp_matrix m;
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 3; column++)
            m.x[row][column] = kmp_link_axes(tree, i, row, column);
    return m;
}

/* v_parent = g v_link, or back. */
static kmp_vec apply_axes(const kmp_tree *tree, int i, bool transposed, kmp_vec v)
{
    const kmp_matrix g = link_matrix(tree, i);
    return kmp_matrix_apply(tree->graph, &g, transposed, v);
}

void kmp_link_turn(const kmp_tree *tree, const kmp_link *link, kmp_ref angle, kmp_vec *v)
{
    if (link->rotation)
        kmp_rotate(tree->graph, angle, &v->x[(link->axis + 1) % 3], &v->x[(link->axis + 2) % 3]);
}

kmp_vec kmp_link_to_parent(const kmp_tree *tree, int i, kmp_vec v)
{
    kmp_link *link = &tree->links[i], *parent = &tree->links[link->parent];
    if (link->follows)
        return v;
    if (!link->stays)
        kmp_link_turn(tree, link, link->q, &v);
    if (link->turned)
        v = apply_axes(tree, i, false, v);
    kmp_link_turn(tree, parent, parent->lag, &v);
    return v;
}

kmp_vec kmp_link_to_child(const kmp_tree *tree, int i, kmp_vec v)
{
    kmp_link *link = &tree->links[i], *parent = &tree->links[link->parent];
    if (link->follows)
        return v;
    kmp_link_turn(tree, parent, kmp_neg(parent->lag), &v);
    if (link->turned)
        v = apply_axes(tree, i, true, v);
    if (!link->stays)
        kmp_link_turn(tree, link, kmp_neg(link->q), &v);
    return v;
}

kmp_tensor kmp_link_tensor_to_parent(const kmp_tree *tree, int i, kmp_tensor t)
{
    kmp_link *link = &tree->links[i], *parent = &tree->links[link->parent];
    if (link->follows)
        return t;
    if (link->rotation && !link->stays)
        t = kmp_tensor_turn(tree->graph, link->axis, link->q, t);
    if (link->turned)
        t = kmp_tensor_turn_by(tree->graph, link_matrix(tree, i), t);
    return kmp_tensor_turn(tree->graph, parent->axis, parent->lag, t);
}

kmp_matrix kmp_link_matrix_to_parent(const kmp_tree *tree, int i, kmp_matrix m)
{
    kmp_link *link = &tree->links[i], *parent = &tree->links[link->parent];
    if (link->follows)
        return m;
    if (link->rotation && !link->stays)
        m = kmp_matrix_turn(tree->graph, link->axis, link->q, m);
    if (link->turned)
        m = kmp_matrix_turn_by(tree->graph, link_matrix(tree, i), m);
    return kmp_matrix_turn(tree->graph, parent->axis, parent->lag, m);
}

kmp_vec kmp_link_slide(const kmp_tree *tree, int i)
{
    const kmp_link *link = &tree->links[i];
    return link->rotation ? kmp_vec_zero() : kmp_vec_axis(link->q, link->axis);
}

void kmp_tree_runs(const kmp_tree *tree, int *run)
{
    for (int i = 1; i < tree->count; i++) {
        const kmp_link *link = &tree->links[i];
        int before = link->parent;
        bool same = !link->turned;
        for (; before > 0 && !tree->links[before].rotation; before = tree->links[before].parent)
            same = same && !tree->links[before].turned;
        same = same && before > 0 && tree->links[before].axis == link->axis;
        run[i - 1] = !link->rotation ? -1 : same ? run[before - 1] : i - 1;
    }
}

int kmp_tree_common(const kmp_tree *tree, int i, int j)
{
    while (i != j) /* a parent has the smaller number */
        if (i > j)
            i = tree->links[i].parent;
        else
            j = tree->links[j].parent;
    return i;
}

bool kmp_tree_is_above(const kmp_tree *tree, int a, int i)
{
    while (i > a)
        i = tree->links[i].parent;
    return i == a;
}
