/* SPDX-License-Identifier: BSD-3-Clause */
#include "dynamics/forces.h"
#include "base/memory.h"
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

/* v of an ancestor's axes in link's. */
static kmp_vec from_ancestor(const kmp_tree *tree, int link, int ancestor, kmp_vec v)
{
    if (link == ancestor)
        return v;
    return kmp_link_to_child(tree, link, from_ancestor(tree, tree->links[link].parent, ancestor, v));
}

/* A force at a point, given in the axes of an ancestor link, onto the point's link. */
static void apply_at(const kmp_tree *tree, int point, int frame, kmp_vec force, kmp_wrench *applied)
{
    kmp_graph *g = tree->graph;
    int link = kmp_point_link(tree, point);
    if (link == 0)
        return;
    force = from_ancestor(tree, link, frame, force);
    kmp_vec moment = kmp_vec_cross(g, kmp_point_local(tree, point), force);
    applied[link].force = kmp_vec_add(g, applied[link].force, force);
    applied[link].moment = kmp_vec_add(g, applied[link].moment, moment);
}

/* Point-to-point spring-damper: tension k (L - L0) + c Ld; with d from the first point to the second and Ld = d.dd / L
 * the force on the first point is (k - k L0 / L + c d.dd / L^2) d. */
static bool add_spring(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, bool energy)
{
    kmp_graph *g = tree->graph;
    int frame;
    kmp_vec d = kmp_point_difference(tree, force->point[0], force->point[1], &frame);
    kmp_ref k = kmp_tree_number(tree, &force->stiffness), c = kmp_tree_number(tree, &force->damping);
    kmp_ref free_length = kmp_tree_number(tree, &force->free_length);
    kmp_ref square = kmp_vec_dot(g, d, d), length = kmp_sqrt(g, square), ratio;
    ratio = kmp_sub(g, k, kmp_div(g, kmp_mul(g, k, free_length), length));
    if (c != KMP_ZERO) {
        kmp_derivative *dt = kmp_time_derivative(tree);
        kmp_vec dd;
        if (!dt)
            return false;
        for (int i = 0; i < 3; i++)
            dd.x[i] = kmp_derivative_of(dt, d.x[i]);
        kmp_derivative_free(dt);
        kmp_ref rate = kmp_vec_dot(g, d, dd); /* L Ld */
        kmp_ref damping = kmp_mul(g, c, kmp_div(g, rate, square));
        ratio = kmp_add(g, ratio, damping);
        if (energy)
            forces->power = kmp_sub(g, forces->power, kmp_mul(g, damping, rate));
    }
    kmp_vec f = kmp_vec_scale(g, ratio, d);
    apply_at(tree, force->point[0], frame, f, forces->applied);
    apply_at(tree, force->point[1], frame, kmp_vec_sub(g, kmp_vec_zero(), f), forces->applied);
    if (energy) {
        kmp_ref stretch = kmp_sub(g, length, free_length);
        kmp_ref work = kmp_mul(g, kmp_mul(g, kmp_const(g, 0.5), k), kmp_mul(g, stretch, stretch));
        forces->potential = kmp_add(g, forces->potential, work);
    }
    return true;
}

/* A constant effort has a potential; any other counts its power. */
static void add_effort(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, bool energy)
{
    kmp_graph *g = tree->graph;
    kmp_ref effort = kmp_tree_expression(tree, force->effort);
    uint32_t k = (uint32_t)force->motion;
    forces->effort[k] = kmp_add(g, forces->effort[k], effort);
    if (!energy)
        return;
    if (kmp_expr_is_constant(force->effort))
        forces->potential = kmp_sub(g, forces->potential, kmp_mul(g, effort, kmp_input(g, KMP_IN_Q, k)));
    else
        forces->power = kmp_add(g, forces->power, kmp_mul(g, effort, kmp_input(g, KMP_IN_QD, k)));
}

/* - m g.x of every body, x in ground axes. */
static kmp_ref gravity_potential(const kmp_tree *tree)
{
    kmp_graph *g = tree->graph;
    kmp_ref v = KMP_ZERO;
    for (int i = 1; i < tree->count; i++) {
        if (tree->links[i].mass == KMP_ZERO)
            continue;
        kmp_vec x = tree->links[i].com;
        for (int k = i; k > 0; k = tree->links[k].parent) {
            x = kmp_link_to_parent(tree, k, kmp_vec_add(g, x, kmp_link_slide(tree, k)));
            x = kmp_vec_add(g, x, tree->links[k].p);
        }
        v = kmp_sub(g, v, kmp_mul(g, tree->links[i].mass, kmp_vec_dot(g, tree->gravity, x)));
    }
    return v;
}

bool kmp_forces_init(kmp_forces *forces, const kmp_tree *tree, bool energy)
{
    const kempe_model *model = tree->model;
    *forces = (kmp_forces){.potential = KMP_ZERO, .power = KMP_ZERO};
    forces->applied = KMP_NEW(kmp_wrench, tree->count);
    forces->effort = KMP_NEW(kmp_ref, tree->count);
    bool ok = forces->applied && forces->effort;
    for (int k = 0; ok && k < model->force_count; k++)
        if (model->forces[k].kind == KMP_FORCE_SPRING)
            ok = add_spring(forces, tree, &model->forces[k], energy);
        else
            add_effort(forces, tree, &model->forces[k], energy);
    if (ok && energy)
        forces->potential = kmp_add(tree->graph, forces->potential, gravity_potential(tree));
    if (!ok || kmp_graph_failed(tree->graph)) {
        kmp_forces_free(forces);
        return false;
    }
    return true;
}

void kmp_forces_free(kmp_forces *forces)
{
    kmp_free(forces->applied);
    kmp_free(forces->effort);
    forces->applied = NULL;
    forces->effort = NULL;
}
