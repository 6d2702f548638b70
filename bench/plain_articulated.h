/* SPDX-License-Identifier: BSD-3-Clause */
/* Accelerations in O(N) as dynamics/formalisms/articulated.c has them, but with articulated inertias as matrices of 6 x
 * 6 entries of which none is taken for another one, as programs with a table of matrices do (Featherstone, Rigid Body
 * Dynamics Algorithms, 2008, table 7.1). Terms that are identically zero are left out. With U = I S, D = S.U and p the
 * force that a link needs at qdd = 0,
 *
 *     I_h += X' (I - U U' / D) X      p_h += X' (p + U (tau - S.p) / D)      qdd = (tau - S.p - U.a) / D
 */
#ifndef KEMPE_BENCH_PLAIN_ARTICULATED_H
#define KEMPE_BENCH_PLAIN_ARTICULATED_H

#include "base/memory.h"
#include "dynamics/formalisms/newton_euler.h"
#include "dynamics/kinematics/kinematics_vectors.h"

/* A motion or a force, the angular part first. */
typedef struct plain_six {
    kmp_vec part[2];
} plain_six;

typedef struct plain_link {
    kmp_ref inertia[6][6];
    plain_six p, u, over, a; /* U in u, U / D in over; accelerations beyond those of qdd = 0 */
    kmp_ref inverse, left;   /* 1 / D, and tau - S.p */
} plain_link;

static inline kmp_ref *plain_entry(plain_six *x, int k)
{
    return &x->part[k / 3].x[k % 3];
}

/* The entry of the joint. */
static inline int plain_along(const kmp_link *link)
{
    return link->axis + (link->rotation ? 0 : 3);
}

static inline kmp_ref plain_dot(kmp_graph *g, plain_six a, plain_six b)
{
    return kmp_add(g, kmp_vec_dot(g, a.part[0], b.part[0]), kmp_vec_dot(g, a.part[1], b.part[1]));
}

static inline plain_six plain_add(kmp_graph *g, plain_six a, plain_six b)
{
    return (plain_six){{kmp_vec_add(g, a.part[0], b.part[0]), kmp_vec_add(g, a.part[1], b.part[1])}};
}

static inline plain_six plain_scale(kmp_graph *g, kmp_ref s, plain_six a)
{
    return (plain_six){{kmp_vec_scale(g, s, a.part[0]), kmp_vec_scale(g, s, a.part[1])}};
}

/* A motion of the parent's origin as one of the link's: X. */
static inline plain_six plain_to_child(const kmp_tree *tree, int i, plain_six h)
{
    kmp_graph *g = tree->graph;
    kmp_vec v = kmp_vec_add(g, h.part[1], kmp_vec_cross(g, h.part[0], tree->links[i].p));
    plain_six r = {{kmp_link_to_child(tree, i, h.part[0]), kmp_link_to_child(tree, i, v)}};
    r.part[1] = kmp_vec_add(g, r.part[1], kmp_vec_cross(g, r.part[0], kmp_link_slide(tree, i)));
    return r;
}

/* A force on the link as one on the parent: X'. */
static inline plain_six plain_to_parent(const kmp_tree *tree, int i, plain_six f)
{
    kmp_wrench own = {.force = f.part[1], .moment = f.part[0]}, parent = {kmp_vec_zero(), kmp_vec_zero()};
    kmp_wrench_to_parent(tree, i, own, &parent);
    return (plain_six){{parent.moment, parent.force}};
}

/* [I - m l~ l~, m l~; - m l~, m 1] */
static inline void plain_own_inertia(const kmp_tree *tree, int i, kmp_ref m[6][6])
{
    kmp_graph *g = tree->graph;
    const kmp_link *link = &tree->links[i];
    kmp_tensor about = kmp_tensor_add(g, link->inertia, kmp_tensor_steiner(g, link->mass, link->com, link->com));
    kmp_vec ml = kmp_vec_scale(g, link->mass, link->com);
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) {
            kmp_ref skew = KMP_ZERO;
            if (r != c)
                skew = (c - r + 3) % 3 == 1 ? kmp_neg(ml.x[3 - r - c]) : ml.x[3 - r - c];
            m[r][c] = about.x[kmp_tensor_at[r][c]];
            m[r][c + 3] = skew;
            m[r + 3][c] = kmp_neg(skew);
            m[r + 3][c + 3] = r == c ? link->mass : KMP_ZERO;
        }
}

/* X' I X: the columns as forces of the parent, then the rows. */
static inline void plain_inertia_to_parent(const kmp_tree *tree, int i, kmp_ref m[6][6])
{
    for (int pass = 0; pass < 2; pass++)
        for (int k = 0; k < 6; k++) {
            plain_six line;
            for (int r = 0; r < 6; r++)
                *plain_entry(&line, r) = pass ? m[k][r] : m[r][k];
            line = plain_to_parent(tree, i, line);
            for (int r = 0; r < 6; r++)
                *(pass ? &m[k][r] : &m[r][k]) = *plain_entry(&line, r);
        }
}

/* From the leaves to the ground. */
static inline void plain_inwards(const kmp_tree *tree, int i, kmp_ref effort, plain_link *l)
{
    kmp_graph *g = tree->graph;
    const kmp_link *link = &tree->links[i];
    plain_link *own = &l[i], *h = &l[link->parent];
    int s = plain_along(link);
    for (int k = 0; k < 6; k++)
        *plain_entry(&own->u, k) = own->inertia[k][s];
    own->inverse = kmp_div(g, KMP_ONE, *plain_entry(&own->u, s));
    own->over = plain_scale(g, own->inverse, own->u);
    *plain_entry(&own->over, s) = KMP_ONE;
    own->left = kmp_sub(g, link->reversed ? kmp_neg(effort) : effort, *plain_entry(&own->p, s));
    if (link->parent == 0)
        return;
    for (int r = 0; r < 6; r++)
        for (int c = 0; c < 6; c++) {
            kmp_ref uu = kmp_mul(g, *plain_entry(&own->u, r), *plain_entry(&own->over, c));
            own->inertia[r][c] = r == s || c == s ? KMP_ZERO : kmp_sub(g, own->inertia[r][c], uu);
        }
    plain_six p = plain_add(g, own->p, plain_scale(g, own->left, own->over));
    h->p = plain_add(g, h->p, plain_to_parent(tree, i, p));
    plain_inertia_to_parent(tree, i, own->inertia);
    for (int r = 0; r < 6; r++)
        for (int c = 0; c < 6; c++)
            h->inertia[r][c] = kmp_add(g, h->inertia[r][c], own->inertia[r][c]);
}

/* From the ground to the leaves. */
static inline void plain_outwards(const kmp_tree *tree, int i, plain_link *l, kmp_ref *qdd)
{
    kmp_graph *g = tree->graph;
    const kmp_link *link = &tree->links[i];
    plain_link *own = &l[i];
    own->a = plain_to_child(tree, i, l[link->parent].a);
    kmp_ref x = kmp_sub(g, kmp_mul(g, own->left, own->inverse), plain_dot(g, own->over, own->a));
    kmp_ref *along = plain_entry(&own->a, plain_along(link));
    *along = kmp_add(g, *along, x);
    *qdd = link->reversed ? kmp_neg(x) : x;
}

/* qdd[k] of motion k from the efforts; false: no memory. */
static inline bool plain_articulated(const kmp_tree *tree, const kmp_wrench *applied, const kmp_ref *effort,
                                     kmp_ref *qdd)
{
    plain_link *l = KMP_NEW(plain_link, tree->count);
    kmp_wrench *share = KMP_NEW(kmp_wrench, tree->count);
    kmp_ref *elastic = KMP_NEW(kmp_ref, tree->count); /* of rigid bodies: not used */
    bool ok = l && share && elastic;
    if (ok)
        kmp_newton_euler_shares(tree, applied, share, elastic);
    for (int i = 1; ok && i < tree->count; i++) {
        plain_own_inertia(tree, i, l[i].inertia);
        l[i].p = (plain_six){{share[i].moment, share[i].force}};
    }
    for (int i = tree->count - 1; ok && i > 0; i--)
        plain_inwards(tree, i, effort[i - 1], l);
    for (int i = 1; ok && i < tree->count; i++)
        plain_outwards(tree, i, l, &qdd[i - 1]);
    kmp_free(elastic);
    kmp_free(share);
    kmp_free(l);
    return ok && !kmp_graph_failed(tree->graph);
}

#endif
