/* SPDX-License-Identifier: BSD-3-Clause */
/* The articulated-body inertia of link i is the resistance of its outward subtree to an acceleration of the link when
 * all joints outward are free. About the link's origin, link axes:
 *
 *     moment = K wd + H a      force = H' wd + A a
 *
 * Unlike for a rigid body A is no multiple of 1 and H is not skew. With U = its column along the joint, I - U U' / S.U
 * is passed on to the parent; the row along the joint is then exactly zero. Velocities and gravity enter through the
 * wrenches that the links need at qdd = 0 (Newton/Euler forward), so that the second sweep computes the accelerations
 * relative to that state.
 *
 * An armature r of the joint makes it I - U U' / (S.U + r), whose row along the joint is not zero. */
#include "dynamics/formalisms/articulated.h"
#include "base/context.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/model.h"

typedef struct inertia {
    kmp_tensor k, a;
    kmp_matrix h;
} inertia;

static kmp_vec tensor_column(kmp_tensor t, int j)
{
    return (kmp_vec){{t.x[kmp_tensor_at[0][j]], t.x[kmp_tensor_at[1][j]], t.x[kmp_tensor_at[2][j]]}};
}

/* t - u v' for the entries of a tensor; row and column `free` are zero (-1: none). */
static void reduce_tensor(kmp_graph *g, kmp_tensor *t, kmp_vec u, kmp_vec v, int free)
{
    for (int i = 0; i < 3; i++)
        for (int j = i; j < 3; j++) {
            kmp_ref *x = &t->x[kmp_tensor_at[i][j]];
            *x = i == free || j == free ? KMP_ZERO : kmp_sub(g, *x, kmp_mul(g, u.x[i], v.x[j]));
        }
}

/* U of the joint and the inertia without its motion: I - U U' / S.U. Returns S.U. */
static kmp_ref release(const kmp_tree *tree, int i, inertia *r, kmp_wrench *passed)
{
    kmp_graph *g = tree->graph;
    const kmp_link *link = &tree->links[i];
    int e = link->axis;
    kmp_wrench u;
    u.moment = link->rotation ? tensor_column(r->k, e) : kmp_vec_of_column(&r->h, e);
    u.force = link->rotation ? kmp_vec_of_row(&r->h, e) : tensor_column(r->a, e);
    kmp_ref along = *kmp_wrench_along(link, &u);
    bool geared = link->armature != KMP_ZERO;
    int turn = link->rotation && !geared ? e : -1, slide = link->rotation || geared ? -1 : e;
    if (geared)
        along = kmp_add(g, along, link->armature);
    if (along == KMP_ZERO)
        return along;
    kmp_ref inverse = kmp_div(g, KMP_ONE, along);
    passed->moment = kmp_vec_scale(g, inverse, u.moment);
    passed->force = kmp_vec_scale(g, inverse, u.force);
    reduce_tensor(g, &r->k, u.moment, passed->moment, turn);
    reduce_tensor(g, &r->a, u.force, passed->force, slide);
    for (int p = 0; p < 3; p++)
        for (int q = 0; q < 3; q++) {
            bool gone = p == turn || q == slide;
            kmp_ref uv = kmp_mul(g, u.moment.x[p], passed->force.x[q]);
            r->h.x[p][q] = gone ? KMP_ZERO : kmp_sub(g, r->h.x[p][q], uv);
        }
    if (!geared)
        *kmp_wrench_along(link, passed) = KMP_ZERO;
    return inverse;
}

/* The inertia about a point d before its origin: H + d~ A, K + d~ H' - (H + d~ A) d~. */
static inertia shifted(kmp_graph *g, inertia r, kmp_vec d)
{
    if (kmp_vec_is_zero(d))
        return r;
    kmp_vec dh[3]; /* columns of d~ H' */
    for (int j = 0; j < 3; j++)
        dh[j] = kmp_vec_cross(g, d, kmp_vec_of_row(&r.h, j));
    for (int j = 0; j < 3; j++) {
        kmp_vec da = kmp_vec_cross(g, d, tensor_column(r.a, j));
        for (int i = 0; i < 3; i++)
            r.h.x[i][j] = kmp_add(g, r.h.x[i][j], da.x[i]);
    }
    for (int i = 0; i < 3; i++) {
        kmp_vec hd = kmp_vec_cross(g, d, kmp_vec_of_row(&r.h, i)); /* - (H d~)' by rows */
        for (int j = i; j < 3; j++) {
            kmp_ref *x = &r.k.x[kmp_tensor_at[i][j]];
            *x = kmp_add(g, *x, kmp_add(g, dh[j].x[i], hd.x[j]));
        }
    }
    return r;
}

static void add_to_parent(const kmp_tree *tree, int i, inertia r, inertia *parent)
{
    kmp_graph *g = tree->graph;
    r = shifted(g, r, kmp_link_slide(tree, i));
    r.k = kmp_link_tensor_to_parent(tree, i, r.k);
    r.a = kmp_link_tensor_to_parent(tree, i, r.a);
    r.h = kmp_link_matrix_to_parent(tree, i, r.h);
    r = shifted(g, r, tree->links[i].p);
    parent->k = kmp_tensor_add(g, parent->k, r.k);
    parent->a = kmp_tensor_add(g, parent->a, r.a);
    for (int p = 0; p < 3; p++)
        for (int q = 0; q < 3; q++)
            parent->h.x[p][q] = kmp_add(g, parent->h.x[p][q], r.h.x[p][q]);
}

kempe_status kmp_articulated_init(kmp_articulated *a, const kmp_tree *tree)
{
    kmp_graph *g = tree->graph;
    inertia *r = KMP_GRAPH_NEW(g, inertia, tree->count);
    *a = (kmp_articulated){.tree = tree,
                           .inverse = KMP_GRAPH_NEW(g, kmp_ref, tree->count),
                           .passed = KMP_GRAPH_NEW(g, kmp_wrench, tree->count),
                           .down = KMP_GRAPH_NEW(g, kmp_wrench, tree->count)};
    /* K, H = b~, A = m 1 with the first moment b. */
    for (int i = 1; !kmp_graph_failed(g) && i < tree->count; i++) {
        const kmp_composite *own = &tree->links[i].own;
        r[i].k = own->inertia;
        for (int n = 0; n < 3; n++) {
            r[i].a.x[n] = own->mass;
            r[i].h.x[(n + 1) % 3][(n + 2) % 3] = kmp_neg(own->moment.x[n]);
            r[i].h.x[(n + 2) % 3][(n + 1) % 3] = own->moment.x[n];
        }
    }
    for (int i = tree->count - 1; !kmp_graph_failed(g) && i > 0; i--) {
        a->inverse[i] = release(tree, i, &r[i], &a->passed[i]);
        if (!kmp_graph_failed(g) && a->inverse[i] == KMP_ZERO) {
            const kempe_model *model = tree->model;
            const kmp_motion *motion = &model->motions[i - 1];
            return kmp_fail(
                model->context, KEMPE_E_FAILED,
                "the O(N) scheme divides by the inertia that a coordinate moves, and coordinate '%s' of body '%s' "
                "moves none; give the bodies it moves %s, or use M and C",
                motion->name, model->bodies[motion->body].name,
                motion->rotation ? "an inertia about its axis" : "a mass");
        }
        if (tree->links[i].parent > 0)
            add_to_parent(tree, i, r[i], &r[tree->links[i].parent]);
    }
    return kmp_graph_failed(g) ? kmp_fail_memory(tree->model->context) : KEMPE_OK;
}

/* A joint whose parent has no acceleration, and that no load accelerates, has none: most joints, for a load on a few.
 */
static bool rests(const kmp_graph *g, const kmp_wrench *parent, kmp_ref load)
{
    return kmp_graph_has_rule(g, KMP_RULE_ZERO) && load == KMP_ZERO && kmp_vec_is_zero(parent->moment) &&
           kmp_vec_is_zero(parent->force);
}

void kmp_articulated_solve(kmp_articulated *a, const kmp_ref *effort, const kmp_wrench *share, kmp_ref *qdd)
{
    for (int i = 0; i < a->tree->count; i++)
        a->down[i] = share ? share[i] : (kmp_wrench){kmp_vec_zero(), kmp_vec_zero()};
    /* Inward sweep: the generalized force left for the joint's own acceleration, and the load on the parent. */
    const kmp_tree *tree = a->tree;
    kmp_graph *g = tree->graph;
    for (int i = tree->count - 1; i > 0; i--) {
        const kmp_link *link = &tree->links[i];
        kmp_wrench w = a->down[i], *passed = &a->passed[i];
        kmp_ref own = effort ? effort[i - 1] : KMP_ZERO, *along = kmp_wrench_along(link, &w);
        own = link->reversed ? kmp_neg(own) : own;
        qdd[i - 1] = kmp_sub(g, own, *along);
        w.moment = kmp_vec_add(g, w.moment, kmp_vec_scale(g, qdd[i - 1], passed->moment));
        w.force = kmp_vec_add(g, w.force, kmp_vec_scale(g, qdd[i - 1], passed->force));
        if (link->armature == KMP_ZERO)
            *along = own;
        if (link->parent > 0)
            kmp_wrench_to_parent(tree, i, w, &a->down[link->parent]);
    }
    /* Outward sweep: accelerations relative to qdd = 0; `moment` is the angular one, `force` that of the origin. */
    kmp_wrench *m = a->down;
    m[0] = (kmp_wrench){kmp_vec_zero(), kmp_vec_zero()};
    for (int i = 1; i < tree->count; i++) {
        const kmp_link *link = &tree->links[i];
        const kmp_wrench *h = &m[link->parent], *passed = &a->passed[i];
        if (rests(g, h, qdd[i - 1])) {
            m[i] = *h;
            continue;
        }
        m[i].moment = kmp_link_to_child(tree, i, h->moment);
        m[i].force = kmp_link_to_child(tree, i, kmp_vec_add(g, h->force, kmp_vec_cross(g, h->moment, link->p)));
        m[i].force = kmp_vec_add(g, m[i].force, kmp_vec_cross(g, m[i].moment, kmp_link_slide(tree, i)));
        kmp_ref along =
            kmp_add(g, kmp_vec_dot(g, passed->moment, m[i].moment), kmp_vec_dot(g, passed->force, m[i].force));
        kmp_ref total = kmp_sub(g, kmp_mul(g, a->inverse[i], qdd[i - 1]), along), *x = kmp_wrench_along(link, &m[i]);
        bool geared = link->armature != KMP_ZERO; /* its own acceleration is a part of `along` then */
        qdd[i - 1] = geared ? total : kmp_sub(g, total, *x);
        *x = geared ? kmp_add(g, *x, total) : total;
        if (link->reversed)
            qdd[i - 1] = kmp_neg(qdd[i - 1]);
    }
}
