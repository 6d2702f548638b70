/* SPDX-License-Identifier: BSD-3-Clause */
/* Vectors, tensors and matrices from the axes of one link in the axes of another, the path between links, points and
 * rates. */
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/model.h"
#include "symbolic/derivative.h"
#include "symbolic/trig.h"
#include <string.h>

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
    for (int k = 0; k < tree->model->motion_count; k++)
        run[k] = -1;
    for (int i = 1; i < tree->count; i++) {
        const kmp_link *link = &tree->links[i];
        int before = link->parent;
        bool same = !link->turned;
        if (link->motion < 0 || !link->rotation)
            continue;
        for (; before > 0 && !tree->links[before].rotation; before = tree->links[before].parent)
            same = same && !tree->links[before].turned;
        same = same && before > 0 && tree->links[before].axis == link->axis && tree->links[before].motion >= 0;
        run[link->motion] = same ? run[tree->links[before].motion] : link->motion;
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

/* -- positions and axes of points, and of vectors of links -------------------------------------------- */

/* Positions are summed from the point inwards. Along a run of rotations about one common axis each constant vector is
 * rotated by the sum of the angles, and the run's vectors are added at its end only. A planar mechanism is then a sum
 * of vectors rotated by absolute angles. */
int kmp_point_link(const kmp_tree *tree, int point)
{
    const kmp_point *p = &tree->model->points[point];
    const int flexible = tree->model->bodies[p->body].flexible - 1;
    return p->station > 0 ? tree->stations[flexible][p->station - 1] : tree->mounts[p->body].link;
}

kmp_vec kmp_point_local(const kmp_tree *tree, int point)
{
    const kmp_point *p = &tree->model->points[point];
    if (p->station > 0) /* whose link has the axes of the body's */
        return kmp_body_vector(tree, p->body, kmp_tree_vector(tree, p->offset));
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

int kmp_point_frame(const kmp_tree *tree, int a, int b)
{
    const kmp_point *points = tree->model->points;
    const int body = kmp_model_common_body(tree->model, points[a].body, points[b].body);
    return tree->model->bodies[body].flexible ? tree->mounts[body].link
                                              : kmp_tree_common(tree, kmp_point_link(tree, a), kmp_point_link(tree, b));
}

kmp_vec kmp_point_difference(const kmp_tree *tree, int a, int b, int *frame)
{
    *frame = kmp_point_frame(tree, a, b);
    return kmp_vec_sub(tree->graph, kmp_point_position(tree, b, *frame), kmp_point_position(tree, a, *frame));
}

kmp_vec kmp_link_direction(const kmp_tree *tree, int link, kmp_vec v, int ancestor)
{
    if (ancestor == 0 && tree->heading && tree->heading[link] != KMP_ZERO) {
        kmp_link_turn(tree, &tree->links[link], tree->heading[link], &v);
        return v;
    }
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

/* -- rates: total derivatives by time, and angular velocities of links --------------------------------- */

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

/* False: no memory. */
static bool make_seeds(const kmp_tree *tree, bool rates)
{
    kmp_graph *g = tree->graph;
    int n = tree->model->motion_count, last = rates ? 2 * n : n;
    int room = last + kmp_tree_time_leaf_count(tree);
    kmp_ref *leaf = tree->seeds->leaf[rates];
    leaf = leaf ? leaf : KMP_GRAPH_NEW(g, kmp_ref, 2 * room);
    if (!leaf)
        return false;
    kmp_ref *direction = leaf + room;
    for (int k = 0; k < n; k++) {
        leaf[k] = kmp_input(g, KMP_IN_Q, (uint32_t)k);
        direction[k] = kmp_input(g, KMP_IN_QD, (uint32_t)k);
        if (rates) {
            leaf[n + k] = direction[k];
            direction[n + k] = kmp_input(g, KMP_IN_QDD, (uint32_t)k);
        }
    }
    last += kmp_tree_time_leaves(tree, leaf + last, direction + last);
    tree->seeds->leaf[rates] = leaf;
    tree->seeds->count[rates] = last;
    return true;
}

bool kmp_tree_seeds_along(const kmp_tree *tree, int count, kmp_time_seeds *seeds)
{
    kmp_graph *g = tree->graph;
    if (tree->seeds->count[0] == 0 && !make_seeds(tree, false))
        return false;
    const int own = tree->seeds->count[0], all = own + count;
    kmp_ref *leaf = KMP_GRAPH_NEW(g, kmp_ref, 2 * all);
    *seeds = (kmp_time_seeds){.count = {all}, .leaf = {leaf}};
    if (!leaf)
        return false;
    memcpy(leaf, tree->seeds->leaf[0], (size_t)own * sizeof *leaf);
    memcpy(leaf + all, tree->seeds->leaf[0] + own, (size_t)own * sizeof *leaf);
    for (int k = 0; k < count; k++) {
        leaf[own + k] = kmp_input(g, KMP_IN_ALONG, (uint32_t)k);
        leaf[all + own + k] = kmp_input(g, KMP_IN_ALONG, (uint32_t)(count + k));
    }
    return true;
}

static kmp_derivative *along_time(const kmp_tree *tree, bool rates)
{
    const kmp_time_seeds *seeds = tree->seeds;
    if (seeds->count[rates] == 0 && !make_seeds(tree, rates))
        return NULL;
    const int count = seeds->count[rates];
    return kmp_derivative_new(tree->graph, count, seeds->leaf[rates], seeds->leaf[rates] + count);
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
        if (l->virtual_spin)
            w = kmp_vec_add(tree->graph, w, *l->virtual_spin);
    }
    for (; link > 0 && tree->links[link].stays; link = tree->links[link].follows ? tree->links[link].parent : 0)
        w = kmp_vec_add(tree->graph, w, kmp_vec_axis(tree->links[link].qd, tree->links[link].axis));
    return w;
}

kmp_ref kmp_virtual_turn(const kmp_tree *tree, int link, int ancestor, int frame, kmp_vec axis)
{
    kmp_ref sum = KMP_ZERO;
    for (; link != ancestor; link = tree->links[link].parent) {
        kmp_vec turn;
        for (uint32_t c = 0; c < 3; c++)
            turn.x[c] = tree->links[link].virtual_spin ? kmp_input(tree->graph, KMP_IN_ALONG, 3 + c) : KMP_ZERO;
        turn = kmp_link_direction(tree, tree->links[link].parent, turn, frame);
        sum = kmp_add(tree->graph, sum, kmp_vec_dot(tree->graph, turn, axis));
    }
    return sum;
}
