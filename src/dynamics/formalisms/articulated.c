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

/* -- rows that are carried ----------------------------------------------------------------------------- */

/* A link needs the wrench I a + p + sum F lambda, and a row that is complete up to it has the value
 * -F.a + sum L lambda + b, over the rows that are not eliminated yet. Releasing a joint with s = J - S.F makes
 *
 *     F + U s / D      L + s s' / D      b + s u / D,
 *
 * and eliminating a row c at the common ancestor of its joints, with the pivot d = L_cc,
 *
 *     I + F_c F_c' / d      p - F_c b_c / d      F - F_c L_c / d      L - L_c L_c' / d      b - L_c b_c / d. */

static kmp_ref *coupling(const kmp_articulated *a, int r, int t)
{
    return &a->coupling[(ptrdiff_t)r * a->carried.rows + t];
}

static void add_coupling(const kmp_articulated *a, int r, int t, kmp_ref more)
{
    *coupling(a, r, t) = *coupling(a, t, r) = kmp_add(a->tree->graph, *coupling(a, r, t), more);
}

/* Finds the link where each row is eliminated, and the links where it is present. False: no memory. */
static bool place_rows(kmp_articulated *a)
{
    const kmp_tree *tree = a->tree;
    kmp_graph *g = tree->graph;
    const int rows = a->carried.rows, n = tree->count - 1;
    int *stamp = KMP_GRAPH_NEW(g, int, tree->count);
    a->first = KMP_GRAPH_NEW(g, int, tree->count + 1);
    a->home = KMP_GRAPH_NEW(g, int, rows);
    if (!stamp || !a->first || !a->home)
        return false;
    for (int r = 0; r < rows; r++) {
        a->home[r] = -1;
        for (int k = 0; k < n; k++)
            if (a->carried.jacobian[(ptrdiff_t)r * n + k] != KMP_ZERO) {
                const int parent = tree->links[k + 1].parent;
                a->home[r] = a->home[r] < 0 ? parent : kmp_tree_common(tree, a->home[r], parent);
            }
        a->home[r] = a->home[r] < 0 ? 0 : a->home[r];
    }
    /* Counts them, then lists them. */
    for (int pass = 0; pass < 2; pass++) {
        for (int r = 0; r < rows; r++) {
            const int mark = 1 + r + pass * rows;
            for (int k = -1; k < n; k++) {
                if (k >= 0 && a->carried.jacobian[(ptrdiff_t)r * n + k] == KMP_ZERO)
                    continue;
                for (int i = k < 0 ? a->home[r] : k + 1; stamp[i] != mark; i = tree->links[i].parent) {
                    stamp[i] = mark;
                    if (pass == 0)
                        a->first[i + 1]++;
                    else
                        a->at[a->first[i + 1]++].row = r;
                    if (i == a->home[r])
                        break;
                }
            }
        }
        if (pass > 0)
            return true;
        for (int i = 0; i < tree->count; i++)
            a->first[i + 1] += a->first[i];
        a->at = KMP_GRAPH_NEW(g, kmp_carried_row, a->first[tree->count]);
        if (!a->at)
            return false;
        for (int i = tree->count; i > 0; i--) /* the ends, which the second pass makes again */
            a->first[i] = a->first[i - 1];
    }
    return true;
}

/* The row at a link, among those listed there; NULL: it is not present. */
static kmp_carried_row *row_at(const kmp_articulated *a, int link, int row)
{
    for (int e = a->first[link]; e < a->first[link + 1]; e++)
        if (a->at[e].row == row)
            return &a->at[e];
    return NULL;
}

/* True for a row at its home after the one that is eliminated, or on the way to its own. */
static bool comes_after(const kmp_articulated *a, int link, const kmp_carried_row *other, int row)
{
    return a->home[other->row] != link || other->row > row;
}

/* Eliminates the rows whose home the link is, one after the other; r: its inertia, NULL: the ground. */
static void eliminate_rows(kmp_articulated *a, int link, inertia *r)
{
    kmp_graph *g = a->tree->graph;
    for (int e = a->first[link]; e < a->first[link + 1]; e++) {
        const kmp_carried_row *c = &a->at[e];
        const int row = c->row;
        if (a->home[row] != link)
            continue;
        kmp_ref missing = kmp_sub(g, KMP_ONE, a->carried.kept[row]);
        a->pivot[row] = kmp_add(g, *coupling(a, row, row), missing);
        a->diagonal[row] = kmp_add(g, a->diagonal[row], missing);
        a->over[row] = kmp_div(g, KMP_ONE, a->pivot[row]);
        const kmp_vec moment = kmp_vec_scale(g, kmp_neg(a->over[row]), c->force.moment);
        const kmp_vec force = kmp_vec_scale(g, kmp_neg(a->over[row]), c->force.force);
        for (int f = a->first[link]; f < a->first[link + 1]; f++) {
            kmp_carried_row *o = &a->at[f];
            if (!comes_after(a, link, o, row) || *coupling(a, row, o->row) == KMP_ZERO)
                continue;
            const kmp_ref by = *coupling(a, row, o->row);
            o->force.moment = kmp_vec_add(g, o->force.moment, kmp_vec_scale(g, by, moment));
            o->force.force = kmp_vec_add(g, o->force.force, kmp_vec_scale(g, by, force));
            const kmp_ref multiple = kmp_mul(g, by, a->over[row]);
            for (int h = f; h < a->first[link + 1]; h++) {
                const int t = a->at[h].row;
                if (comes_after(a, link, &a->at[h], row) && *coupling(a, row, t) != KMP_ZERO)
                    add_coupling(a, o->row, t, kmp_neg(kmp_mul(g, multiple, *coupling(a, row, t))));
            }
        }
        if (!r)
            continue;
        reduce_tensor(g, &r->k, c->force.moment, moment, -1);
        reduce_tensor(g, &r->a, c->force.force, force, -1);
        for (int p = 0; p < 3; p++)
            for (int q = 0; q < 3; q++)
                r->h.x[p][q] = kmp_sub(g, r->h.x[p][q], kmp_mul(g, c->force.moment.x[p], force.x[q]));
    }
}

/* Carries the rows over the released joint of link i to its parent. */
static void carry_rows(kmp_articulated *a, int i)
{
    const kmp_tree *tree = a->tree;
    kmp_graph *g = tree->graph;
    const kmp_link *link = &tree->links[i];
    for (int e = a->first[i]; e < a->first[i + 1]; e++) {
        kmp_carried_row *c = &a->at[e];
        if (a->home[c->row] == i)
            continue;
        kmp_ref own = a->carried.jacobian[(ptrdiff_t)c->row * (tree->count - 1) + i - 1];
        own = kmp_mul(g, a->carried.kept[c->row], link->reversed ? kmp_neg(own) : own);
        c->effort = kmp_sub(g, own, *kmp_wrench_along(link, &c->force));
        c->share = kmp_mul(g, c->effort, a->inverse[i]);
        kmp_wrench w = c->force;
        w.moment = kmp_vec_add(g, w.moment, kmp_vec_scale(g, c->effort, a->passed[i].moment));
        w.force = kmp_vec_add(g, w.force, kmp_vec_scale(g, c->effort, a->passed[i].force));
        if (link->armature == KMP_ZERO)
            *kmp_wrench_along(link, &w) = own;
        kmp_wrench_to_parent(tree, i, w, &row_at(a, link->parent, c->row)->force);
    }
    for (int e = a->first[i]; e < a->first[i + 1]; e++)
        for (int f = e; f < a->first[i + 1]; f++) {
            const kmp_carried_row *c = &a->at[e], *o = &a->at[f];
            if (a->home[c->row] == i || a->home[o->row] == i)
                continue;
            const kmp_ref product = kmp_mul(g, c->effort, o->share);
            add_coupling(a, c->row, o->row, product);
            if (e == f)
                a->diagonal[c->row] = kmp_add(g, a->diagonal[c->row], product);
        }
}

/* -- inertias -------------------------------------------------------------------------------------------- */

static kempe_status fail_massless(const kempe_model *model, int k)
{
    const kmp_motion *motion = &model->motions[k];
    return kmp_fail(model->context, KEMPE_E_FAILED,
                    "the O(N) scheme divides by the inertia that a coordinate moves, and coordinate '%s' of body '%s' "
                    "moves none; give the bodies it moves %s, or use M and C",
                    motion->name, model->bodies[motion->body].name,
                    motion->rotation ? "an inertia about its axis" : "a mass");
}

static bool allocate(kmp_articulated *a)
{
    kmp_graph *g = a->tree->graph;
    const int rows = a->carried.rows;
    return KMP_GRAPH_MAKE(g, KMP_ROOM(kmp_ref, a->tree->count, &a->inverse),
                          KMP_ROOM(kmp_wrench, a->tree->count, &a->passed, &a->down),
                          KMP_ROOM(kmp_ref, rows, &a->pivot, &a->diagonal, &a->over, &a->left),
                          KMP_ROOM(kmp_ref, (size_t)rows * (size_t)rows, &a->coupling)) &&
           place_rows(a);
}

kempe_status kmp_articulated_init(kmp_articulated *a, const kmp_tree *tree, const kmp_carried *carried)
{
    kmp_graph *g = tree->graph;
    inertia *r = KMP_GRAPH_NEW(g, inertia, tree->count);
    *a = (kmp_articulated){.tree = tree};
    if (carried)
        a->carried = *carried;
    KMP_TRY(kmp_made(tree->model->context, r && allocate(a)));
    /* K, H = b~, A = m 1 with the first moment b. */
    for (int i = 1; i < tree->count; i++) {
        const kmp_composite *own = &tree->links[i].own;
        r[i].k = own->inertia;
        for (int n = 0; n < 3; n++) {
            r[i].a.x[n] = own->mass;
            r[i].h.x[(n + 1) % 3][(n + 2) % 3] = kmp_neg(own->moment.x[n]);
            r[i].h.x[(n + 2) % 3][(n + 1) % 3] = own->moment.x[n];
        }
    }
    for (int i = tree->count - 1; !kmp_graph_failed(g) && i > 0; i--) {
        eliminate_rows(a, i, &r[i]);
        a->inverse[i] = release(tree, i, &r[i], &a->passed[i]);
        if (!kmp_graph_failed(g) && a->inverse[i] == KMP_ZERO)
            return fail_massless(tree->model, i - 1);
        carry_rows(a, i);
        if (tree->links[i].parent > 0)
            add_to_parent(tree, i, r[i], &r[tree->links[i].parent]);
    }
    if (!kmp_graph_failed(g))
        eliminate_rows(a, 0, NULL);
    return kmp_graph_failed(g) ? kmp_fail_memory(tree->model->context) : KEMPE_OK;
}

/* -- accelerations --------------------------------------------------------------------------------------- */

/* The curves that rows leave to their multipliers where they are eliminated. */
static void leave_curves(kmp_articulated *a, int link)
{
    kmp_graph *g = a->tree->graph;
    for (int e = a->first[link]; e < a->first[link + 1]; e++) {
        const kmp_carried_row *c = &a->at[e];
        if (a->home[c->row] != link)
            continue;
        const kmp_ref part = kmp_neg(kmp_mul(g, a->over[c->row], a->left[c->row]));
        kmp_wrench *w = &a->down[link];
        w->moment = kmp_vec_add(g, w->moment, kmp_vec_scale(g, part, c->force.moment));
        w->force = kmp_vec_add(g, w->force, kmp_vec_scale(g, part, c->force.force));
        for (int f = a->first[link]; f < a->first[link + 1]; f++)
            if (comes_after(a, link, &a->at[f], c->row)) {
                const int t = a->at[f].row;
                a->left[t] = kmp_add(g, a->left[t], kmp_mul(g, *coupling(a, c->row, t), part));
            }
    }
}

/* The multipliers of the rows that are eliminated at a link, from its acceleration: the last one first. */
static void find_multipliers(const kmp_articulated *a, int link, const kmp_wrench *m, kmp_ref *lambda)
{
    kmp_graph *g = a->tree->graph;
    for (int e = a->first[link + 1]; e-- > a->first[link];) {
        const kmp_carried_row *c = &a->at[e];
        if (a->home[c->row] != link)
            continue;
        kmp_ref sum =
            kmp_sub(g, kmp_add(g, kmp_vec_dot(g, c->force.moment, m->moment), kmp_vec_dot(g, c->force.force, m->force)),
                    a->left[c->row]);
        for (int f = a->first[link]; f < a->first[link + 1]; f++)
            if (comes_after(a, link, &a->at[f], c->row))
                sum = kmp_sub(g, sum, kmp_mul(g, *coupling(a, c->row, a->at[f].row), lambda[a->at[f].row]));
        lambda[c->row] = kmp_mul(g, sum, a->over[c->row]);
    }
}

/* A joint whose parent has no acceleration, and that no load accelerates, has none: most joints, for a load on a few.
 */
static bool rests(const kmp_graph *g, const kmp_wrench *parent, kmp_ref load)
{
    return kmp_graph_has_rule(g, KMP_RULE_ZERO) && load == KMP_ZERO && kmp_vec_is_zero(parent->moment) &&
           kmp_vec_is_zero(parent->force);
}

/* The generalized force left for each joint's own acceleration, in `qdd`, and the load on its parent. */
static void sweep_inwards(kmp_articulated *a, const kmp_ref *effort, kmp_ref *qdd)
{
    const kmp_tree *tree = a->tree;
    kmp_graph *g = tree->graph;
    for (int i = tree->count - 1; i > 0; i--) {
        const kmp_link *link = &tree->links[i];
        leave_curves(a, i);
        kmp_wrench w = a->down[i], *passed = &a->passed[i];
        kmp_ref own = effort ? effort[i - 1] : KMP_ZERO, *along = kmp_wrench_along(link, &w);
        own = link->reversed ? kmp_neg(own) : own;
        qdd[i - 1] = kmp_sub(g, own, *along);
        for (int e = a->first[i]; e < a->first[i + 1]; e++)
            if (a->home[a->at[e].row] != i)
                a->left[a->at[e].row] = kmp_add(g, a->left[a->at[e].row], kmp_mul(g, a->at[e].share, qdd[i - 1]));
        w.moment = kmp_vec_add(g, w.moment, kmp_vec_scale(g, qdd[i - 1], passed->moment));
        w.force = kmp_vec_add(g, w.force, kmp_vec_scale(g, qdd[i - 1], passed->force));
        if (link->armature == KMP_ZERO)
            *along = own;
        if (link->parent > 0)
            kmp_wrench_to_parent(tree, i, w, &a->down[link->parent]);
    }
    leave_curves(a, 0);
}

/* Accelerations relative to qdd = 0; `moment` is the angular one, `force` that of the origin. */
static void sweep_outwards(kmp_articulated *a, const kmp_articulated_result *result)
{
    const kmp_tree *tree = a->tree;
    kmp_graph *g = tree->graph;
    kmp_ref *qdd = result->qdd;
    kmp_wrench *m = a->down;
    m[0] = (kmp_wrench){kmp_vec_zero(), kmp_vec_zero()};
    find_multipliers(a, 0, &m[0], result->lambda);
    for (int i = 1; i < tree->count; i++) {
        const kmp_link *link = &tree->links[i];
        const kmp_wrench *h = &m[link->parent], *passed = &a->passed[i];
        kmp_ref pushed = KMP_ZERO; /* by multipliers */
        for (int e = a->first[i]; e < a->first[i + 1]; e++)
            if (a->home[a->at[e].row] != i)
                pushed = kmp_add(g, pushed, kmp_mul(g, a->at[e].share, result->lambda[a->at[e].row]));
        if (a->first[i] == a->first[i + 1] && rests(g, h, qdd[i - 1])) {
            m[i] = *h;
            if (result->open)
                result->open[i - 1] = qdd[i - 1];
            continue;
        }
        m[i].moment = kmp_link_to_child(tree, i, h->moment);
        m[i].force = kmp_link_to_child(tree, i, kmp_vec_add(g, h->force, kmp_vec_cross(g, h->moment, link->p)));
        m[i].force = kmp_vec_add(g, m[i].force, kmp_vec_cross(g, m[i].moment, kmp_link_slide(tree, i)));
        kmp_ref along =
            kmp_add(g, kmp_vec_dot(g, passed->moment, m[i].moment), kmp_vec_dot(g, passed->force, m[i].force));
        kmp_ref open = kmp_sub(g, kmp_mul(g, a->inverse[i], qdd[i - 1]), along), *x = kmp_wrench_along(link, &m[i]);
        kmp_ref total = kmp_add(g, open, pushed);
        bool geared = link->armature != KMP_ZERO; /* its own acceleration is a part of `along` then */
        qdd[i - 1] = geared ? total : kmp_sub(g, total, *x);
        open = geared ? open : kmp_sub(g, open, *x);
        *x = geared ? kmp_add(g, *x, total) : total;
        if (link->reversed)
            qdd[i - 1] = kmp_neg(qdd[i - 1]);
        if (result->open)
            result->open[i - 1] = link->reversed ? kmp_neg(open) : open;
        find_multipliers(a, i, &m[i], result->lambda);
    }
}

void kmp_articulated_solve(kmp_articulated *a, const kmp_ref *effort, const kmp_wrench *share, const kmp_ref *curve,
                           const kmp_articulated_result *result)
{
    for (int i = 0; i < a->tree->count; i++)
        a->down[i] = share ? share[i] : (kmp_wrench){kmp_vec_zero(), kmp_vec_zero()};
    for (int r = 0; r < a->carried.rows; r++)
        a->left[r] = kmp_mul(a->tree->graph, a->carried.kept[r], curve[r]);
    sweep_inwards(a, effort, result->qdd);
    sweep_outwards(a, result);
}
