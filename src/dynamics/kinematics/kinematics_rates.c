/* SPDX-License-Identifier: BSD-3-Clause */
/* Rates: total derivatives by time, and angular velocities of links. */
#include "dynamics/kinematics/link_tree.h"
#include "symbolic/derivative.h"

int kmp_tree_time_leaves(const kmp_tree *tree, kmp_ref *leaf, kmp_ref *direction)
{
    kmp_graph *g = tree->graph;
    int count = 0;
    leaf[count] = kmp_input(g, KMP_IN_TIME, 0);
    direction[count++] = KMP_ONE;
    for (int k = 0; k < tree->model->input_count; k++)
        for (int d = 0; d + 1 < KMP_TIME_NUMBERS; d++) {
            leaf[count] = kmp_input(g, KMP_IN_TIME, kmp_time_index(k, d));
            direction[count++] = kmp_input(g, KMP_IN_TIME, kmp_time_index(k, d + 1));
        }
    return count;
}

kmp_derivative *kmp_partial_time_derivative(const kmp_tree *tree)
{
    int count = kmp_tree_time_leaf_count(tree);
    kmp_ref *leaf = KMP_GRAPH_NEW(tree->graph, kmp_ref, 2 * count);
    if (!leaf)
        return NULL;
    return kmp_derivative_new(tree->graph, kmp_tree_time_leaves(tree, leaf, leaf + count), leaf, leaf + count);
}

static kmp_derivative *along_time(const kmp_tree *tree, bool rates)
{
    kmp_graph *g = tree->graph;
    int n = tree->count - 1, last = rates ? 2 * n : n;
    int room = last + kmp_tree_time_leaf_count(tree);
    kmp_ref *leaf = KMP_GRAPH_NEW(g, kmp_ref, 2 * room);
    if (!leaf)
        return NULL;
    kmp_ref *direction = leaf + room;
    for (int k = 0; k < n; k++) { /* the inputs themselves, whatever the sign of both in the joint */
        leaf[k] = tree->links[k + 1].q & ~(kmp_ref)1;
        direction[k] = tree->links[k + 1].qd & ~(kmp_ref)1;
        if (rates) {
            leaf[n + k] = direction[k];
            direction[n + k] = kmp_input(g, KMP_IN_QDD, (uint32_t)k);
        }
    }
    last += kmp_tree_time_leaves(tree, leaf + last, direction + last);
    return kmp_derivative_new(g, last, leaf, direction);
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
