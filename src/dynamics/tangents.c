/* SPDX-License-Identifier: BSD-3-Clause */
/* Spatial vectors: S_i is the motion of joint i, v and a are velocity and acceleration (less gravity) of links, F_i is
 * the wrench that moves the subtree of i. With, for j at or above i,
 *
 *     psi'_j = v_h x S_j      psi''_j = a_h x S_j + v_h x psi'_j       (h the parent of j)
 *     2 B = v x* I - I v x + (I v) x-* summed over the subtree,        ((f x-*) v = v x* f)
 *
 * the generalized forces tau_i = S_i.F_i have the derivatives
 *
 *     tau_i by q_j:  S_i.(2 B_i psi'_j + I_i psi''_j)     tau_j by q_i:  S_j.(2 B_i psi'_i + I_i psi''_i + S_i x* F_i)
 *     tau_i by qd_j: S_i.(2 B_i S_j + 2 I_i psi'_j)       tau_j by qd_i: S_j.(2 B_i S_i + 2 I_i psi'_i)
 *
 * (Singh, Russell and Wensing, IEEE Robotics and Automation Letters 7 (2022) 1776; recursions for the same purpose:
 * Carpentier and Mansard, Robotics: Science and Systems 2018). The formulas below are for links of one joint each, in
 * their own axes.
 *
 * An additional constant velocity of the whole system changes nothing; each link uses the one that leaves its origin at
 * rest. About that origin v = (w, 0) and 2 B depends only on rotations: it maps (x, y) to (2 H x, x x 2 f) with
 *
 *     H = sum m (rd.r 1 - rd r')      f = sum m rd      r, rd: position and velocity of a particle
 *
 * which for one body are -w~ P and w x b with P = sum m r r' = tr(K)/2 1 - K and b = sum m r. For an origin O' at d
 * from O, with velocity u relative to it, the steps are, in this order:
 *
 *     2H + u2.b 1 - u2 b',   2f + m u2,   + d.2f 1 - 2f d',   u2 = 2 u
 *
 * The rows S_i I_i and S_i 2 B_i are passed from O' to O as a wrench and as three numbers, to which u2 x (force of S_i
 * I_i) is added. For a joint that rotates about e, psi' = (w x e, 0) and psi'' = (beta e, alpha x e). For one that
 * translates they are (0, w x e) and (0, beta e). w, beta, alpha belong to the link itself, because e belongs to
 * both sides of the joint.
 *
 * Forces of the model act as wrenches whose components in link axes depend on q and qd. These are differentiated one by
 * one and projected on the joints; their rotation with the links is in S x* F. */
#include "dynamics/tangents.h"
#include "base/memory.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/link_tree.h"
#include "symbolic/cost.h"
#include "symbolic/derivative.h"
#include <string.h>

/* Twice H and f of a subtree. */
typedef struct flow {
    kmp_matrix h;
    kmp_vec f;
} flow;

/* Derivatives by one joint: twice w x e, once, and psi''; the terms of a rotation or a translation. */
typedef struct change {
    kmp_vec twice, first;
    kmp_vec angular, linear;
} change;

typedef struct scheme {
    const kmp_tree *tree;
    kmp_graph *g;
    kmp_link_motion *m;
    kmp_wrench *w; /* of the subtree, about the origin */
    kmp_vec *twice_w;
    kmp_vec *slide_rate, *base_rate; /* u2 along the joint, link axes; of the joint's base, parent's axes */
    kmp_composite *body;
    flow *flow;
    change *change;
    kmp_ref *by_q, *by_qd;
    kmp_ref *power_q, *power_qd; /* NULL: not requested */
} scheme;

/* -- links --------------------------------------------------------------------------------------------- */

static void set_rates(scheme *s, int i)
{
    const kmp_link *link = &s->tree->links[i];
    kmp_ref two = kmp_const(s->g, 2);
    s->twice_w[i] = kmp_vec_scale(s->g, two, s->m[i].w);
    s->base_rate[i] = kmp_vec_cross(s->g, s->twice_w[link->parent], link->p);
    if (link->rotation)
        return;
    kmp_vec along = kmp_vec_axis(kmp_mul(s->g, two, link->qd), link->axis);
    s->slide_rate[i] = kmp_vec_add(s->g, kmp_vec_cross(s->g, s->twice_w[i], kmp_link_slide(s->tree, i)), along);
}

/* 2 H = w2~ (K - tr(K)/2 1), by columns. */
static flow own_flow(const scheme *s, int i)
{
    kmp_graph *g = s->g;
    kmp_tensor k = s->body[i].inertia;
    flow own;
    kmp_ref sum = kmp_add(g, kmp_add(g, k.x[0], k.x[1]), k.x[2]), half = kmp_mul(g, kmp_const(g, 0.5), sum);
    for (int d = 0; d < 3; d++)
        k.x[d] = kmp_sub(g, k.x[d], half);
    for (int j = 0; j < 3; j++) {
        kmp_vec column = kmp_vec_cross(g, s->twice_w[i], kmp_tensor_apply(g, k, kmp_vec_axis(KMP_ONE, j)));
        for (int n = 0; n < 3; n++)
            own.h.x[n][j] = column.x[n];
    }
    own.f = kmp_vec_cross(g, s->twice_w[i], s->body[i].moment);
    return own;
}

/* h + a.b 1 - a b' */
static void add_product(kmp_graph *g, kmp_matrix *h, kmp_vec a, kmp_vec b)
{
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        kmp_ref sum = kmp_add(g, kmp_mul(g, a.x[j], b.x[j]), kmp_mul(g, a.x[k], b.x[k]));
        h->x[i][i] = kmp_add(g, h->x[i][i], sum);
        h->x[i][j] = kmp_sub(g, h->x[i][j], kmp_mul(g, a.x[i], b.x[j]));
        h->x[i][k] = kmp_sub(g, h->x[i][k], kmp_mul(g, a.x[i], b.x[k]));
    }
}

/* Moves the flow from an origin at d, whose velocity is half of `rate`, before the body itself is moved. */
static void shift_flow(kmp_graph *g, flow *x, const kmp_composite *c, kmp_vec d, kmp_vec rate)
{
    add_product(g, &x->h, rate, c->moment);
    x->f = kmp_vec_add(g, x->f, kmp_vec_scale(g, c->mass, rate));
    add_product(g, &x->h, x->f, d);
}

static void add_to_parent(scheme *s, int i)
{
    kmp_graph *g = s->g;
    int h = s->tree->links[i].parent;
    kmp_composite c = s->body[i];
    flow x = s->flow[i], *to = &s->flow[h];
    shift_flow(g, &x, &c, kmp_link_slide(s->tree, i), s->slide_rate[i]);
    c = kmp_composite_at_joint(s->tree, i, c);
    x.h = kmp_link_matrix_to_parent(s->tree, i, x.h);
    x.f = kmp_link_to_parent(s->tree, i, x.f);
    shift_flow(g, &x, &c, s->tree->links[i].p, s->base_rate[i]);
    to->f = kmp_vec_add(g, to->f, x.f);
    for (int k = 0; k < 9; k++)
        to->h.x[k / 3][k % 3] = kmp_add(g, to->h.x[k / 3][k % 3], x.h.x[k / 3][k % 3]);
    kmp_composite_to_parent(s->tree, i, s->body[i], &s->body[h]);
}

/* -- columns and rows ---------------------------------------------------------------------------------- */

/* Data passed from joint i to the ground: the wrenches that q_i and qd_i change, and the rows S I, S 2 B. */
typedef struct pass {
    kmp_wrench by_q, by_qd, inertia;
    kmp_vec rate;
} pass;

/* I (x, y) + 2 B (z, 0) */
static kmp_wrench force_of(const scheme *s, int i, kmp_vec x, kmp_vec y, kmp_vec z)
{
    kmp_graph *g = s->g;
    const kmp_composite *c = &s->body[i];
    kmp_wrench w;
    w.moment = kmp_vec_add(g, kmp_tensor_apply(g, c->inertia, x), kmp_vec_cross(g, c->moment, y));
    w.force = kmp_vec_add(g, kmp_vec_scale(g, c->mass, y), kmp_vec_cross(g, x, c->moment));
    for (int k = 0; k < 3; k++)
        for (int j = 0; j < 3; j++)
            w.moment.x[k] = kmp_add(g, w.moment.x[k], kmp_mul(g, s->flow[i].h.x[k][j], z.x[j]));
    w.force = kmp_vec_add(g, w.force, kmp_vec_cross(g, z, s->flow[i].f));
    return w;
}

static pass pass_from(const scheme *s, int i)
{
    kmp_graph *g = s->g;
    const kmp_link *link = &s->tree->links[i];
    const change *c = &s->change[i];
    const kmp_matrix *h = &s->flow[i].h;
    kmp_vec e = kmp_vec_axis(KMP_ONE, link->axis), none = kmp_vec_zero();
    pass p;
    if (link->rotation) {
        p.by_q = force_of(s, i, c->angular, c->linear, c->first);
        p.by_qd = force_of(s, i, c->twice, none, e);
        p.inertia = force_of(s, i, e, none, none);
        p.rate = kmp_vec_of_row(h, link->axis);
        p.by_q.force = kmp_vec_add(g, p.by_q.force, kmp_vec_cross(g, e, s->w[i].force));
        p.by_q.moment = kmp_vec_add(g, p.by_q.moment, kmp_vec_cross(g, e, s->w[i].moment));
    } else {
        p.by_q = force_of(s, i, none, c->linear, none);
        p.by_qd = force_of(s, i, none, c->twice, none);
        p.inertia = force_of(s, i, none, e, none);
        p.rate = kmp_vec_cross(g, s->flow[i].f, e);
        p.by_q.moment = kmp_vec_add(g, p.by_q.moment, kmp_vec_cross(g, e, s->w[i].force));
    }
    return p;
}

static kmp_wrench moved(const kmp_tree *tree, int k, kmp_wrench w)
{
    kmp_wrench out = {kmp_vec_zero(), kmp_vec_zero()};
    kmp_wrench_to_parent(tree, k, w, &out);
    return out;
}

/* Signed like q_i and q_k. */
static void put_entry(scheme *s, kmp_ref *to, int i, int k, kmp_ref x)
{
    const kmp_link *links = s->tree->links;
    to[(i - 1) * (s->tree->count - 1) + k - 1] = links[i].reversed != links[k].reversed ? kmp_neg(x) : x;
}

/* Derivatives of the generalized force of joint h by q_i and qd_i, and the reverse. */
static void cross_at(scheme *s, int i, int h, pass *p)
{
    kmp_graph *g = s->g;
    const kmp_link *link = &s->tree->links[h];
    const change *c = &s->change[h];
    kmp_ref q = kmp_vec_dot(g, p->inertia.force, c->linear), qd;
    if (link->rotation) {
        q = kmp_add(g, q, kmp_vec_dot(g, p->inertia.moment, c->angular));
        q = kmp_add(g, q, kmp_vec_dot(g, p->rate, c->first));
        qd = kmp_add(g, kmp_vec_dot(g, p->inertia.moment, c->twice), p->rate.x[link->axis]);
    } else {
        qd = kmp_vec_dot(g, p->inertia.force, c->twice);
    }
    put_entry(s, s->by_q, h, i, *kmp_wrench_along(link, &p->by_q));
    put_entry(s, s->by_qd, h, i, *kmp_wrench_along(link, &p->by_qd));
    put_entry(s, s->by_q, i, h, q);
    put_entry(s, s->by_qd, i, h, qd);
}

static void all_passes(scheme *s)
{
    const kmp_link *links = s->tree->links;
    for (int i = s->tree->count - 1; i > 0; i--) {
        pass p = pass_from(s, i);
        put_entry(s, s->by_q, i, i, *kmp_wrench_along(&links[i], &p.by_q));
        put_entry(s, s->by_qd, i, i, *kmp_wrench_along(&links[i], &p.by_qd));
        for (int k = i; links[k].parent > 0; k = links[k].parent) {
            /* Passes the data from link k to its parent. */
            kmp_graph *g = s->g;
            p.rate = kmp_vec_add(g, p.rate, kmp_vec_cross(g, s->slide_rate[k], p.inertia.force));
            p.rate = kmp_link_to_parent(s->tree, k, p.rate);
            p.inertia = moved(s->tree, k, p.inertia);
            p.rate = kmp_vec_add(g, p.rate, kmp_vec_cross(g, s->base_rate[k], p.inertia.force));
            p.by_q = moved(s->tree, k, p.by_q);
            p.by_qd = moved(s->tree, k, p.by_qd);
            cross_at(s, i, links[k].parent, &p);
        }
        if (links[i].parent > 0)
            add_to_parent(s, i);
    }
}

/* -- forces of the model ------------------------------------------------------------------------------- */

enum { COMPONENTS = 6 };

static kmp_ref *component(kmp_wrench *w, int k)
{
    return k < 3 ? &w->force.x[k] : &w->moment.x[k - 3];
}

/* Non-rotating axes do not turn with joint j, though the links do: components of vectors fixed to link i rotate
 * backwards. */
static void turn_back(const scheme *s, const kmp_forces *forces, int j, kmp_wrench *w)
{
    const kmp_link *links = s->tree->links;
    kmp_vec e = kmp_vec_axis(links[j].reversed ? kmp_neg(KMP_ONE) : KMP_ONE, links[j].axis);
    for (int i = j; links[j].stays && i < s->tree->count; i++) {
        int above = i;
        while (above > j && links[above].follows)
            above = links[above].parent;
        if (above != j)
            continue;
        w[i].force = kmp_vec_sub(s->g, w[i].force, kmp_vec_cross(s->g, e, forces->applied[i].force));
        w[i].moment = kmp_vec_sub(s->g, w[i].moment, kmp_vec_cross(s->g, e, forces->applied[i].moment));
    }
}

/* Subtracts the effect of the wrenches w on the generalized forces from column j - 1 of `to`, then sets them to zero.
 */
static void bring_to_joints(const scheme *s, int j, kmp_wrench *w, kmp_ref *to)
{
    const kmp_link *links = s->tree->links;
    int n = s->tree->count - 1;
    for (int i = n; i > 0; i--) {
        if (!kmp_vec_is_zero(w[i].force) || !kmp_vec_is_zero(w[i].moment)) {
            kmp_ref x = *kmp_wrench_along(&links[i], &w[i]), *entry = &to[(i - 1) * n + j - 1];
            *entry = kmp_sub(s->g, *entry, links[i].reversed ? kmp_neg(x) : x);
            kmp_wrench_to_parent(s->tree, i, w[i], &w[links[i].parent]);
        }
        w[i] = (kmp_wrench){kmp_vec_zero(), kmp_vec_zero()};
    }
    w[0] = (kmp_wrench){kmp_vec_zero(), kmp_vec_zero()};
}

/* Collects all components, the generalized forces and, if requested, the power: it moves with the same expressions. */
static void collect_forces(const scheme *s, const kmp_forces *forces, kmp_ref *value)
{
    int links = s->tree->count, n = links - 1;
    for (int k = 0; k < COMPONENTS * links; k++)
        value[k] = *component(&forces->applied[k / COMPONENTS], k % COMPONENTS);
    for (int k = 0; k < n; k++)
        value[COMPONENTS * links + k] = forces->effort[k];
    value[COMPONENTS * links + n] = s->power_q ? forces->power : KMP_ZERO;
}

static void force_columns(scheme *s, const kmp_forces *forces, kmp_partials *partials, kmp_wrench *w)
{
    int links = s->tree->count, n = links - 1;
    for (int k = 0; k < 2 * n; k++) {
        kmp_ref *to = k < n ? s->by_q : s->by_qd;
        int j = k % n + 1;
        const int *which;
        const kmp_ref *value;
        kmp_ref leaf = kmp_input(s->g, k < n ? KMP_IN_Q : KMP_IN_QD, (uint32_t)j - 1);
        int count = kmp_partials_along(partials, leaf, &which, &value);
        for (int i = 0; i < count; i++)
            if (which[i] < COMPONENTS * links) {
                *component(&w[which[i] / COMPONENTS], which[i] % COMPONENTS) = value[i];
            } else if (which[i] < COMPONENTS * links + n) {
                kmp_ref *entry = &to[(which[i] - COMPONENTS * links) * n + j - 1];
                *entry = kmp_sub(s->g, *entry, value[i]);
            } else {
                (k < n ? s->power_q : s->power_qd)[j - 1] = value[i];
            }
        if (k < n)
            turn_back(s, forces, j, w);
        bring_to_joints(s, j, w, to);
    }
}

/* -- the whole ----------------------------------------------------------------------------------------- */

void kmp_tangents_composite(const kmp_tree *tree, const kmp_ref *qdd, const kmp_forces *forces, kmp_ref *by_q,
                            kmp_ref *by_qd, kmp_ref *power_q, kmp_ref *power_qd)
{
    scheme s = {.tree = tree, .g = tree->graph, .by_q = by_q, .by_qd = by_qd, .power_q = power_q, .power_qd = power_qd};
    kmp_ref *effort = KMP_GRAPH_NEW(s.g, kmp_ref, tree->count);
    int n = tree->count - 1;
    for (int k = 0; k < n * n; k++)
        by_q[k] = by_qd[k] = KMP_ZERO;
    if (!effort)
        return;
    int count = s.tree->count;
    KMP_GRAPH_MAKE(s.g, KMP_ROOM(kmp_link_motion, count, &s.m), KMP_ROOM(kmp_wrench, count, &s.w),
                   KMP_ROOM(kmp_vec, count, &s.twice_w, &s.slide_rate, &s.base_rate),
                   KMP_ROOM(kmp_composite, count, &s.body), KMP_ROOM(flow, count, &s.flow),
                   KMP_ROOM(change, count, &s.change));
    if (kmp_graph_failed(s.g))
        return;
    kmp_newton_euler_whole(tree, qdd, forces->applied, s.m, s.w, effort);
    for (int i = 1; i < tree->count; i++) {
        set_rates(&s, i);
        const kmp_link *link = &s.tree->links[i];
        const kmp_link_motion *m = &s.m[i];
        kmp_vec e = kmp_vec_axis(KMP_ONE, link->axis), p;
        change *c = &s.change[i];
        c->first = kmp_vec_cross(s.g, m->w, e);
        c->twice = kmp_vec_cross(s.g, s.twice_w[i], e);
        p = kmp_vec_of_column(&m->beta, link->axis);
        c->angular = link->rotation ? p : kmp_vec_zero();
        c->linear = link->rotation ? kmp_vec_cross(s.g, m->alpha, e) : p;
        s.body[i] = tree->links[i].own;
        s.flow[i] = own_flow(&s, i);
    }
    all_passes(&s);
    int links = s.tree->count;
    kmp_ref *value = KMP_GRAPH_NEW(s.g, kmp_ref, (COMPONENTS + 1) * links);
    kmp_wrench *w = KMP_GRAPH_NEW(s.g, kmp_wrench, links);
    if (!value || !w)
        return;
    collect_forces(&s, forces, value);
    kmp_partials *partials = kmp_partials_new(s.g, (COMPONENTS + 1) * links, value);
    force_columns(&s, forces, partials, w);
    kmp_partials_free(partials);
}

/* -- variants of tangents ---------------------------------------------------------------------------- */

/* The choice of the shorter derivation of the same matrices. */

/* The first of the lists with the fewest operations. false: no memory. */
static bool find_shortest(const kmp_graph *g, int count, const kmp_ref *const *list, int lists, int *best)
{
    kmp_cost cost = {0};
    long least = -1;
    bool ok = kmp_cost_init(&cost, g, KMP_COST_ADDITION);
    for (int k = 0; ok && k < lists; k++) {
        kmp_cost_add(&cost, count, list[k]);
        if (k > 0)
            kmp_cost_remove(&cost, count, list[k - 1]);
        ok = !cost.failed;
        if (least < 0 || cost.operations < least) {
            least = cost.operations;
            *best = k;
        }
    }
    kmp_cost_free(&cost);
    return ok;
}

bool kmp_tangents_mirror(const kmp_graph *g, int n, kmp_ref *matrix)
{
    kmp_ref *upper = KMP_NEW(kmp_ref, n * n); /* the upper triangle and its mirror image */
    const kmp_ref *const list[2] = {matrix, upper};
    int best = 0;
    for (int i = 0; upper && i < n; i++)
        for (int k = 0; k <= i; k++) {
            kmp_ref *below = &matrix[i * n + k], *above = &matrix[k * n + i];
            if (*below == KMP_ZERO || *above == KMP_ZERO)
                *below = *above = KMP_ZERO; /* a zero has a twin that is one */
            upper[i * n + k] = upper[k * n + i] = *above;
        }
    bool ok = upper && find_shortest(g, n * n, list, 2, &best);
    if (ok && best)
        memcpy(matrix, upper, (size_t)(n * n) * sizeof *matrix);
    kmp_free(upper);
    return ok;
}

static void share_zeros(int count, kmp_ref *const of[2])
{
    for (int k = 0; of[0] && k < count; k++)
        if (of[0][k] == KMP_ZERO || of[1][k] == KMP_ZERO)
            of[0][k] = of[1][k] = KMP_ZERO;
}

/* Exchanges a list that is counted for another one, if that exists. Adding first leaves common operations in use. */
static void turn_to(kmp_cost *cost, int count, kmp_ref *const list[2], int to, int *now)
{
    if (*now == to || !list[to])
        return;
    kmp_cost_add(cost, count, list[to]);
    if (*now >= 0)
        kmp_cost_remove(cost, count, list[*now]);
    *now = to;
}

bool kmp_tangents_choose(const kmp_graph *g, int others, const kmp_ref *other, int count, kmp_ref *const by_q[2],
                         kmp_ref *const by_qd[2], kmp_tangent_choice *choice)
{
    kmp_cost cost = {0};
    bool ok = kmp_cost_init(&cost, g, KMP_COST_ADDITION);
    share_zeros(count, by_q);
    share_zeros(count, by_qd);
    *choice = (kmp_tangent_choice){.operations = -1};
    if (ok)
        kmp_cost_add(&cost, others, other);
    long sum[4] = {-1, -1, -1, -1};
    if (ok) {
        /* Operations of the present outputs with each pair of lists; -1: there is no such pair. From one pair to the
         * next, one list changes. */
        static const int order[] = {0, 1, 3, 2};
        int now[2] = {-1, -1};
        for (int k = 0; k < 4; k++) {
            int q = order[k] & 1, qd = order[k] >> 1;
            bool absent = (q && !by_q[1]) || (qd && !by_qd[1]);
            if (!absent) {
                turn_to(&cost, count, by_q, q, &now[0]);
                turn_to(&cost, count, by_qd, qd, &now[1]);
            }
            sum[order[k]] = absent ? -1 : cost.operations;
        }
    }
    ok = ok && !cost.failed;
    for (int pair = 0; ok && pair < 4; pair++) {
        if (sum[pair] < 0)
            continue;
        if (choice->operations < 0 || sum[pair] < choice->operations)
            *choice = (kmp_tangent_choice){pair & 1, pair >> 1, sum[pair], 0};
        choice->second = sum[pair]; /* of the last choice */
    }
    kmp_cost_free(&cost);
    return ok;
}
