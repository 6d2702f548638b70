/* SPDX-License-Identifier: BSD-3-Clause */
/* Rates: total derivatives by time, and angular velocities of links. */
#include "base/memory.h"
#include "dynamics/kinematics/kinematics.h"
#include "symbolic/derivative.h"

kmp_derivative *kmp_time_derivative(const kmp_tree *tree)
{
    kmp_graph *g = tree->graph;
    int n = tree->count - 1;
    kmp_ref *leaf = KMP_NEW(kmp_ref, n + 1), *direction = KMP_NEW(kmp_ref, n + 1);
    kmp_derivative *d = NULL;
    if (leaf && direction) {
        for (int k = 0; k < n; k++) {
            leaf[k] = kmp_input(g, KMP_IN_Q, (uint32_t)k);
            direction[k] = kmp_input(g, KMP_IN_QD, (uint32_t)k);
        }
        leaf[n] = kmp_input(g, KMP_IN_TIME, 0);
        direction[n] = KMP_ONE;
        d = kmp_derivative_new(g, n + 1, leaf, direction);
    }
    kmp_free(leaf);
    kmp_free(direction);
    return d;
}

kmp_vec kmp_from_ancestor(const kmp_tree *tree, int link, int ancestor, kmp_vec v)
{
    if (link == ancestor)
        return v;
    return kmp_link_to_child(tree, link, kmp_from_ancestor(tree, tree->links[link].parent, ancestor, v));
}

kmp_vec kmp_link_spin(const kmp_tree *tree, int link, int ancestor)
{
    kmp_vec w = kmp_vec_zero();
    for (; link != ancestor; link = tree->links[link].parent) {
        const kmp_link *l = &tree->links[link];
        if (l->rotation)
            w = kmp_vec_add(tree->graph, w, kmp_vec_axis(l->qd, l->axis));
        w = kmp_link_to_parent(tree, link, w);
    }
    for (; link > 0 && tree->links[link].stays; link = tree->links[link].follows ? tree->links[link].parent : 0)
        w = kmp_vec_add(tree->graph, w, kmp_vec_axis(tree->links[link].qd, tree->links[link].axis));
    return w;
}
