/* SPDX-License-Identifier: BSD-3-Clause */
#include "constraints/kinds/parts.h"
#include <math.h>

int kmp_part_frame(const kmp_tree *tree, const kmp_closure *closure)
{
    return kmp_tree_common(tree, kmp_point_link(tree, closure->point[0]), kmp_point_link(tree, closure->point[1]));
}

/* A body that carries another one has the smaller number. */
kmp_vec kmp_part_own(const kmp_tree *tree, const kmp_closure *closure, kmp_vec v)
{
    const kempe_model *model = tree->model;
    int i = model->points[closure->point[0]].body, k = model->points[closure->point[1]].body;
    while (i != k)
        if (i > k)
            i = model->bodies[i].parent;
        else
            k = model->bodies[k].parent;
    return kmp_body_vector_back(tree, i, v);
}

/* a and b of a unit vector e: coordinate axes when it is one. */
static void across(const double e[3], double a[3], double b[3])
{
    int k = fabs(e[2]) >= fabs(e[0]) && fabs(e[2]) >= fabs(e[1]) ? 2 : fabs(e[1]) >= fabs(e[0]) ? 1 : 0;
    int i = (k + 1) % 3, j = (k + 2) % 3;
    double length = sqrt(e[k] * e[k] + e[i] * e[i]);
    a[k] = -e[i] / length + 0.0;
    a[i] = e[k] / length;
    a[j] = 0;
    for (int n = 0; n < 3; n++)
        b[n] = e[(n + 1) % 3] * a[(n + 2) % 3] - e[(n + 2) % 3] * a[(n + 1) % 3] + 0.0;
}

void kmp_part_axes(const kmp_tree *tree, const kmp_closure *closure, int side, kmp_vec axes[3])
{
    double a[3], b[3];
    int frame = kmp_part_frame(tree, closure), point = closure->point[side];
    across(closure->axis[side], a, b);
    axes[0] = kmp_point_direction(tree, point, closure->axis[side], frame);
    axes[1] = kmp_point_direction(tree, point, a, frame);
    axes[2] = kmp_point_direction(tree, point, b, frame);
}

static kmp_vec sum(kmp_graph *g, const kmp_ref *factor, kmp_vec u, kmp_vec v)
{
    return kmp_vec_add(g, kmp_vec_scale(g, factor[0], u), kmp_vec_scale(g, factor[1], v));
}

/* -- points -------------------------------------------------------------------------------------- */

kmp_vec kmp_part_gap(const kmp_tree *tree, const kmp_closure *closure)
{
    int frame;
    return kmp_point_difference(tree, closure->point[0], closure->point[1], &frame);
}

void kmp_part_ball(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    kmp_vec d = kmp_part_own(tree, closure, kmp_part_gap(tree, closure));
    for (int k = 0; k < 3; k++)
        h[k] = d.x[k];
}

void kmp_part_line(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    kmp_vec d = kmp_part_gap(tree, closure), axes[3];
    kmp_part_axes(tree, closure, 0, axes);
    for (int k = 0; k < 2; k++)
        h[k] = kmp_vec_dot(tree->graph, axes[1 + k], d);
}

kmp_vec kmp_part_line_force(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda)
{
    kmp_vec axes[3];
    kmp_part_axes(tree, closure, 0, axes);
    return kmp_part_own(tree, closure, sum(tree->graph, lambda, axes[1], axes[2]));
}

/* -- directions ---------------------------------------------------------------------------------- */

void kmp_part_parallel(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    kmp_vec first[3], second[3];
    kmp_part_axes(tree, closure, 0, first);
    kmp_part_axes(tree, closure, 1, second);
    for (int k = 0; k < 2; k++)
        h[k] = kmp_vec_dot(tree->graph, first[1 + k], second[0]);
}

kmp_vec kmp_part_parallel_moment(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda)
{
    kmp_vec first[3], second[3];
    kmp_part_axes(tree, closure, 0, first);
    kmp_part_axes(tree, closure, 1, second);
    kmp_vec moment = kmp_vec_cross(tree->graph, second[0], sum(tree->graph, lambda, first[1], first[2]));
    return kmp_part_own(tree, closure, moment);
}

static void point_axes(const kmp_tree *tree, const kmp_closure *closure, kmp_vec first[3], kmp_vec second[3])
{
    int frame = kmp_part_frame(tree, closure);
    kmp_point_axes(tree, closure->point[0], frame, first);
    kmp_point_axes(tree, closure->point[1], frame, second);
}

void kmp_part_aligned(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    kmp_graph *g = tree->graph;
    kmp_vec first[3], second[3];
    point_axes(tree, closure, first, second);
    for (int k = 0; k < 3; k++) {
        int i = (k + 1) % 3, j = (k + 2) % 3;
        kmp_ref twice = kmp_sub(g, kmp_vec_dot(g, first[j], second[i]), kmp_vec_dot(g, first[i], second[j]));
        h[k] = kmp_mul(g, kmp_const(g, 0.5), twice);
    }
}

kmp_vec kmp_part_aligned_moment(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda)
{
    kmp_graph *g = tree->graph;
    kmp_vec first[3], second[3], moment = kmp_vec_zero();
    point_axes(tree, closure, first, second);
    for (int k = 0; k < 3; k++) {
        int i = (k + 1) % 3, j = (k + 2) % 3;
        kmp_vec a = kmp_vec_cross(g, second[i], first[j]), b = kmp_vec_cross(g, second[j], first[i]);
        kmp_ref half = kmp_mul(g, kmp_const(g, 0.5), lambda[k]);
        moment = kmp_vec_add(g, moment, kmp_vec_scale(g, half, kmp_vec_sub(g, a, b)));
    }
    return kmp_part_own(tree, closure, moment);
}
