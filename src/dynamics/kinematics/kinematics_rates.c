/* SPDX-License-Identifier: BSD-3-Clause */
/* Rates: total derivatives by time, and angular velocities of links. */
#include "dynamics/kinematics/link_tree.h"
#include "symbolic/derivative.h"

static kmp_derivative *along_time(const kmp_tree *tree, bool rates)
{
    kmp_graph *g = tree->graph;
    int n = tree->count - 1, last = rates ? 2 * n : n;
    kmp_ref *leaf = KMP_GRAPH_NEW(g, kmp_ref, 2 * (last + 1)), *direction = leaf + last + 1;
    if (!leaf)
        return NULL;
    for (int k = 0; k < n; k++) {
        leaf[k] = kmp_input(g, KMP_IN_Q, (uint32_t)k);
        direction[k] = kmp_input(g, KMP_IN_QD, (uint32_t)k);
        if (rates) {
            leaf[n + k] = direction[k];
            direction[n + k] = kmp_input(g, KMP_IN_QDD, (uint32_t)k);
        }
    }
    leaf[last] = kmp_input(g, KMP_IN_TIME, 0);
    direction[last] = KMP_ONE;
    return kmp_derivative_new(g, last + 1, leaf, direction);
}

kmp_derivative *kmp_time_derivative(const kmp_tree *tree)
{
    return along_time(tree, false);
}

static kmp_vec differentiate(kmp_derivative *d, kmp_vec x)
{
    for (int k = 0; k < 3; k++)
        x.x[k] = kmp_derivative_of(d, x.x[k]);
    kmp_derivative_free(d);
    return x;
}

kmp_vec kmp_vec_rate(const kmp_tree *tree, kmp_vec x)
{
    return differentiate(along_time(tree, false), x);
}

kmp_vec kmp_vec_acceleration(const kmp_tree *tree, kmp_vec rate)
{
    return differentiate(along_time(tree, true), rate);
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
