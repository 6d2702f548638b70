/* SPDX-License-Identifier: BSD-3-Clause */
/* The origin of link i moves by d, fixed to it: p of i grows by d; vectors fixed to i (its centre of mass, its
 * children's p, points) decrease by d. A component is moved by the same symbol, so that the difference is a symbolic
 * zero. */
#include "dynamics/shorten/variants.h"

/* The part of v that the joint lets its origin move by; none if that depended on anything but numbers. */
static kmp_vec along(const kmp_tree *tree, int i, kmp_vec v)
{
    const kmp_link *link = &tree->links[i];
    for (int k = 0; k < 3; k++) {
        if (link->rotation && k != link->axis)
            v.x[k] = KMP_ZERO;
        if (kmp_graph_node(tree->graph, kmp_id(v.x[k]))->depends & ~(1u << KMP_IN_PARAMETER))
            return kmp_vec_zero();
    }
    return v;
}

static int first_child(const kmp_tree *tree, int i)
{
    for (int k = i + 1; k < tree->count; k++)
        if (tree->links[k].parent == i)
            return k;
    return 0;
}

static kmp_vec target(const kmp_tree *tree, int i, kmp_origin to)
{
    const kmp_link *link = &tree->links[i];
    int child = to == KMP_ORIGIN_CHILD ? first_child(tree, i) : 0;
    if (to == KMP_ORIGIN_PARENT)
        return kmp_vec_sub(tree->graph, kmp_vec_zero(), kmp_link_to_child(tree, i, link->p));
    if (to == KMP_ORIGIN_MASS && link->mass != KMP_ZERO)
        return link->com;
    return child ? tree->links[child].p : kmp_vec_zero();
}

static void move(kmp_tree *tree, int i, kmp_vec d)
{
    kmp_graph *g = tree->graph;
    kmp_link *link = &tree->links[i];
    link->p = kmp_vec_add(g, link->p, kmp_link_to_parent(tree, i, d));
    if (link->body >= 0 || link->mass != KMP_ZERO)
        link->com = kmp_vec_sub(g, link->com, d);
    for (int k = i + 1; k < tree->count; k++)
        if (tree->links[k].parent == i)
            tree->links[k].p = kmp_vec_sub(g, tree->links[k].p, d);
    for (int b = 1; b < tree->model->body_count; b++)
        if (tree->mounts[b].link == i)
            tree->mounts[b].p = kmp_vec_sub(g, tree->mounts[b].p, d);
}

void kmp_move_origins(kmp_tree *tree, const uint8_t *origin)
{
    for (int i = 1; i < tree->count; i++) {
        kmp_vec d = origin[i - 1] ? along(tree, i, target(tree, i, (kmp_origin)origin[i - 1])) : kmp_vec_zero();
        if (!kmp_vec_is_zero(d))
            move(tree, i, d);
    }
}
