/* SPDX-License-Identifier: BSD-3-Clause */
/* Positions and axes of points, and of vectors of links.
 *
 * Positions are summed from the point inwards. Along a run of rotations about one common axis each constant vector is
 * rotated by the sum of the angles, and the run's vectors are added at its end only. A planar mechanism is then a sum
 * of vectors rotated by absolute angles. */
#include "dynamics/kinematics/link_tree.h"

int kmp_point_link(const kmp_tree *tree, int point)
{
    return tree->mounts[tree->model->points[point].body].link;
}

kmp_vec kmp_point_local(const kmp_tree *tree, int point)
{
    const kmp_point *p = &tree->model->points[point];
    kmp_vec at = kmp_body_vector(tree, p->body, kmp_tree_vector(tree, p->at));
    return kmp_vec_add(tree->graph, tree->mounts[p->body].p, at);
}

enum { MAX_RUN = 32 };

/* Vectors of one run of parallel axes, waiting to be added. */
typedef struct run {
    kmp_vec v[MAX_RUN];
    int count;
} run;

static void gather(kmp_graph *g, run *r)
{
    for (int k = 1; k < r->count; k++)
        r->v[0] = kmp_vec_add(g, r->v[0], r->v[k]);
    r->count = 1;
}

/* True if link i turns about the direction of the link before it, with nothing between. */
static bool same_run(const kmp_tree *tree, int i, int before)
{
    const kmp_link *a = &tree->links[i], *b = &tree->links[before];
    return a->rotation && b->rotation && a->axis == b->axis && !b->turned;
}

kmp_vec kmp_link_position(const kmp_tree *tree, int link, kmp_vec local, int ancestor)
{
    kmp_graph *g = tree->graph;
    run r = {.count = 1};
    r.v[0] = local;
    for (int i = link, before = -1; i != ancestor; before = i, i = tree->links[i].parent) {
        if (before < 0 || !same_run(tree, i, before) || r.count == MAX_RUN)
            gather(g, &r);
        kmp_vec slide = kmp_link_slide(tree, i);
        for (int k = 0; k < r.count; k++)
            r.v[k] = kmp_link_to_parent(tree, i, k == 0 ? kmp_vec_add(g, r.v[0], slide) : r.v[k]);
        if (!kmp_vec_is_zero(tree->links[i].p))
            r.v[r.count++] = tree->links[i].p;
    }
    gather(g, &r);
    return r.v[0];
}

kmp_vec kmp_point_position(const kmp_tree *tree, int point, int ancestor)
{
    return kmp_link_position(tree, kmp_point_link(tree, point), kmp_point_local(tree, point), ancestor);
}

kmp_vec kmp_point_difference(const kmp_tree *tree, int a, int b, int *frame)
{
    *frame = kmp_tree_common(tree, kmp_point_link(tree, a), kmp_point_link(tree, b));
    return kmp_vec_sub(tree->graph, kmp_point_position(tree, b, *frame), kmp_point_position(tree, a, *frame));
}

kmp_vec kmp_link_direction(const kmp_tree *tree, int link, kmp_vec v, int ancestor)
{
    for (int i = link; i != ancestor; i = tree->links[i].parent)
        v = kmp_link_to_parent(tree, i, v);
    return v;
}

kmp_vec kmp_point_direction(const kmp_tree *tree, int point, const double v[3], int ancestor)
{
    const kmp_point *p = &tree->model->points[point];
    kmp_vec d;
    for (int i = 0; i < 3; i++) {
        double x = p->turned ? p->axes[i][0] * v[0] + p->axes[i][1] * v[1] + p->axes[i][2] * v[2] : v[i];
        d.x[i] = kmp_const(tree->graph, x);
    }
    return kmp_link_direction(tree, kmp_point_link(tree, point), kmp_body_vector(tree, p->body, d), ancestor);
}

void kmp_point_axes(const kmp_tree *tree, int point, int ancestor, kmp_vec axes[3])
{
    static const double unit[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (int k = 0; k < 3; k++)
        axes[k] = kmp_point_direction(tree, point, unit[k], ancestor);
}
