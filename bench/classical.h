/* SPDX-License-Identifier: BSD-3-Clause */
/* The classical non-recursive form, to compare with: the virtual power of d'Alembert's forces, summed over the bodies
 * (Wittenburg 1977; Kane and Levinson 1985). With the partial velocities v_k, w_k of a body along its ancestors k, in
 * ground axes,
 *
 *     M_kl = sum m v_k.v_l + w_k.(I w_l)      C_k = sum v_k.(m (a - g) - F) + w_k.(I wd + w x (I w) - L)
 *
 * where a and wd are the accelerations at qdd = 0. Nothing is passed from body to body but positions and rates. */
#ifndef KEMPE_BENCH_CLASSICAL_H
#define KEMPE_BENCH_CLASSICAL_H

#include "base/memory.h"
#include "dynamics/formalisms/newton_euler.h"
#include "dynamics/kinematics/kinematics_vectors.h"

typedef struct classical_link {
    kmp_vec axis, origin; /* of the joint, in ground axes */
    kmp_vec w, v, wd, a;  /* of the link and its origin; accelerations at qdd = 0 */
} classical_link;

static inline kmp_vec classical_to_ground(const kmp_tree *tree, int i, kmp_vec v)
{
    for (; i > 0; i = tree->links[i].parent)
        v = kmp_link_to_parent(tree, i, v);
    return v;
}

/* w x (w x r) + wd x r */
static inline kmp_vec classical_turning(kmp_graph *g, const classical_link *l, kmp_vec r)
{
    kmp_vec inner = kmp_vec_cross(g, l->w, r);
    return kmp_vec_add(g, kmp_vec_cross(g, l->w, inner), kmp_vec_cross(g, l->wd, r));
}

static inline void classical_kinematics(const kmp_tree *tree, int i, classical_link *links)
{
    kmp_graph *g = tree->graph;
    const kmp_link *link = &tree->links[i];
    const classical_link *h = &links[link->parent];
    classical_link *l = &links[i];
    kmp_vec offset = classical_to_ground(tree, link->parent, link->p);
    l->axis = classical_to_ground(tree, i, kmp_vec_axis(link->reversed ? kmp_neg(KMP_ONE) : KMP_ONE, link->axis));
    kmp_vec rate = classical_to_ground(tree, i, kmp_vec_axis(link->qd, link->axis));
    kmp_vec slide = classical_to_ground(tree, i, kmp_link_slide(tree, i)), r = kmp_vec_add(g, offset, slide);
    l->origin = kmp_vec_add(g, h->origin, r);
    l->w = h->w;
    l->wd = h->wd;
    l->v = kmp_vec_add(g, h->v, kmp_vec_cross(g, h->w, r));
    l->a = kmp_vec_add(g, h->a, classical_turning(g, h, r));
    if (link->rotation) {
        l->w = kmp_vec_add(g, h->w, rate);
        l->wd = kmp_vec_add(g, h->wd, kmp_vec_cross(g, h->w, rate));
        return;
    }
    l->v = kmp_vec_add(g, l->v, rate);
    l->a = kmp_vec_add(g, l->a, kmp_vec_scale(g, kmp_const(g, 2), kmp_vec_cross(g, h->w, rate)));
}

/* I u for u in ground axes: into the link's axes and back. */
static inline kmp_vec classical_inertia(const kmp_tree *tree, int i, kmp_vec u)
{
    kmp_vec in;
    for (int k = 0; k < 3; k++) {
        kmp_vec axis = classical_to_ground(tree, i, kmp_vec_axis(KMP_ONE, k));
        in.x[k] = kmp_vec_dot(tree->graph, axis, u);
    }
    return classical_to_ground(tree, i, kmp_tensor_apply(tree->graph, tree->links[i].inertia, in));
}

/* v_k of a point at x, and w_k, for joint k. */
static inline void classical_partial(const kmp_tree *tree, const classical_link *links, int k, kmp_vec x, kmp_vec *v,
                                     kmp_vec *w)
{
    kmp_graph *g = tree->graph;
    bool turns = tree->links[k].rotation;
    *v = turns ? kmp_vec_cross(g, links[k].axis, kmp_vec_sub(g, x, links[k].origin)) : links[k].axis;
    *w = turns ? links[k].axis : kmp_vec_zero();
}

/* One body's share of M and C. */
static inline void classical_body(const kmp_tree *tree, int i, const classical_link *links, const kmp_wrench *applied,
                                  kmp_ref *mass, kmp_ref *bias)
{
    kmp_graph *g = tree->graph;
    const kmp_link *link = &tree->links[i];
    int n = tree->count - 1;
    kmp_vec l = classical_to_ground(tree, i, link->com), x = kmp_vec_add(g, links[i].origin, l);
    kmp_vec a = kmp_vec_add(g, links[i].a, classical_turning(g, &links[i], l));
    kmp_vec force = kmp_vec_scale(g, link->mass, kmp_vec_sub(g, a, tree->gravity));
    kmp_vec moment = kmp_vec_cross(g, links[i].w, classical_inertia(tree, i, links[i].w));
    moment = kmp_vec_add(g, moment, classical_inertia(tree, i, links[i].wd));
    kmp_vec f = classical_to_ground(tree, i, applied[i].force), t = classical_to_ground(tree, i, applied[i].moment);
    for (int k = i; k > 0; k = tree->links[k].parent) {
        kmp_vec vk, wk, vo, wo;
        classical_partial(tree, links, k, x, &vk, &wk);
        classical_partial(tree, links, k, links[i].origin, &vo, &wo);
        kmp_ref power = kmp_add(g, kmp_vec_dot(g, vk, force), kmp_vec_dot(g, wk, moment));
        power = kmp_sub(g, power, kmp_add(g, kmp_vec_dot(g, vo, f), kmp_vec_dot(g, wo, t)));
        bias[k - 1] = kmp_add(g, bias[k - 1], power);
        for (int j = k; j > 0; j = tree->links[j].parent) {
            kmp_vec vj, wj;
            classical_partial(tree, links, j, x, &vj, &wj);
            kmp_ref *m = &mass[(k - 1) * n + j - 1];
            *m = kmp_add(g, *m, kmp_mul(g, link->mass, kmp_vec_dot(g, vk, vj)));
            *m = kmp_add(g, *m, kmp_vec_dot(g, wj, classical_inertia(tree, i, wk)));
        }
    }
}

/* M (lower triangle, mass[i * n + k]) and C less the efforts; both zero before. false: no memory. */
static inline bool classical_derive(const kmp_tree *tree, const kmp_wrench *applied, kmp_ref *mass, kmp_ref *bias)
{
    classical_link *links = KMP_NEW(classical_link, tree->count);
    if (!links)
        return false;
    for (int i = 1; i < tree->count; i++)
        classical_kinematics(tree, i, links);
    for (int i = 1; i < tree->count; i++)
        classical_body(tree, i, links, applied, mass, bias);
    kmp_free(links);
    return !kmp_graph_failed(tree->graph);
}

#endif
