/* SPDX-License-Identifier: BSD-3-Clause */
/* The articulated-body inertia of link i is the resistance of its outward subtree to an acceleration of the link when
 * all joints outward are free. About the link's origin, link axes:
 *
 *     moment = K wd + H a      force = H' wd + A a
 *
 * Unlike for a rigid body A is not a multiple of 1 and H is not skew. With U = its column along the joint, I - U U' /
 * S.U is passed on to the parent; the row along the joint is then exactly zero. Velocities and gravity enter through
 * the wrenches that the links need at qdd = 0 (Newton/Euler forward), so that the second sweep computes the
 * accelerations relative to that state.
 *
 * An armature r of the joint makes it I - U U' / (S.U + r), whose row along the joint is not zero. */
#include "dynamics/formalisms/articulated.h"
#include "base/context.h"
#include "dynamics/formalisms/flexible_body.h"
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

/* The link of a coordinate; of one of a flexible body the link where it is eliminated. */
static int link_of(const kmp_articulated *a, int motion)
{
    const int link = a->tree->of_motion[motion];
    for (int k = 0; link == 0 && k < a->tree->model->flexible_count; k++) {
        const kmp_deformation *d = a->elastic[k].of;
        if (motion >= d->first && motion < d->first + d->count)
            return d->innermost;
    }
    return link;
}

/* Finds the link where each row is eliminated, and the links where it is present. False: no memory. */
static bool place_rows(kmp_articulated *a)
{
    const kmp_tree *tree = a->tree;
    kmp_graph *g = tree->graph;
    const int rows = a->carried.rows, n = tree->model->motion_count;
    int *stamp = KMP_GRAPH_NEW(g, int, tree->count);
    a->first = KMP_GRAPH_NEW(g, int, tree->count + 1);
    a->home = KMP_GRAPH_NEW(g, int, rows);
    if (!stamp || !a->first || !a->home)
        return false;
    for (int r = 0; r < rows; r++) {
        a->home[r] = -1;
        for (int k = 0; k < n; k++)
            if (a->carried.jacobian[(ptrdiff_t)r * n + k] != KMP_ZERO) {
                const int parent = tree->links[link_of(a, k)].parent;
                a->home[r] = a->home[r] < 0 ? parent : kmp_tree_common(tree, a->home[r], parent);
            }
        a->home[r] = a->home[r] < 0 ? 0 : a->home[r];
        if (a->region[a->home[r]] > 0) /* coordinates of this body may still couple with it */
            a->home[r] = tree->links[a->elastic[a->region[a->home[r]] - 1].of->innermost].parent;
    }
    /* Counts them, then lists them. */
    for (int pass = 0; pass < 2; pass++) {
        for (int r = 0; r < rows; r++) {
            const int mark = 1 + r + pass * rows;
            for (int k = -1; k < n; k++) {
                if (k >= 0 && a->carried.jacobian[(ptrdiff_t)r * n + k] == KMP_ZERO)
                    continue;
                for (int i = k < 0 ? a->home[r] : link_of(a, k); stamp[i] != mark; i = tree->links[i].parent) {
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

/* r - u v'. */
static void subtract_product(kmp_graph *g, inertia *r, const kmp_wrench *u, const kmp_wrench *v)
{
    reduce_tensor(g, &r->k, u->moment, v->moment, -1);
    reduce_tensor(g, &r->a, u->force, v->force, -1);
    for (int p = 0; p < 3; p++)
        for (int q = 0; q < 3; q++)
            r->h.x[p][q] = kmp_sub(g, r->h.x[p][q], kmp_mul(g, u->moment.x[p], v->force.x[q]));
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
        if (r)
            subtract_product(g, r, &c->force, &(kmp_wrench){.moment = moment, .force = force});
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
        kmp_ref own = a->carried.jacobian[(ptrdiff_t)c->row * tree->model->motion_count + link->motion];
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

/* -- coordinates of flexible bodies ---------------------------------------------------------------------- */

/* Links of a flexible body need the wrench I a + sum f_e qdd_e + p + sum F lambda. Its own inertia and each guided
 * link, which moves by s(q) along S, add to f_e and to the inertia A of the coordinates (formalisms/flexible_body.c),
 * and J_e - sum s_e S.F is the coefficient of qdd_e in a row. At the innermost link, eliminating qdd_e with the pivot D
 * = A_ee makes
 *
 *     I - f_e f_e' / D      f - f_e A_e / D      A - A_e A_e' / D      F + f_e s / D      s - A_e s_e / D      L + s s'
 * / D. */

static kmp_wrench *column_at(const kmp_articulated_elastic *x, int link)
{
    return x->at + (ptrdiff_t)x->of->count * link;
}

static void add_multiple(kmp_graph *g, kmp_wrench *w, kmp_ref factor, const kmp_wrench *more)
{
    w->moment = kmp_vec_add(g, w->moment, kmp_vec_scale(g, factor, more->moment));
    w->force = kmp_vec_add(g, w->force, kmp_vec_scale(g, factor, more->force));
}

/* The coefficients of a guided link in the rows that pass it. */
static void guide_rows(kmp_articulated *a, const kmp_articulated_elastic *x, int i)
{
    kmp_graph *g = a->tree->graph;
    const kmp_guide *guide = a->tree->links[i].guide;
    for (int k = a->first[i]; k < a->first[i + 1]; k++) {
        const kmp_ref along = *kmp_wrench_along(&a->tree->links[i], &a->at[k].force);
        for (int e = 0; e < guide->count; e++) {
            kmp_ref *sum = &x->row[a->at[k].row * guide->count + e];
            *sum = kmp_sub(g, *sum, kmp_mul(g, guide->slope[e], along));
        }
    }
}

/* Rows after the elimination of coordinate e. */
static void reduce_rows(kmp_articulated *a, const kmp_articulated_elastic *x, int e)
{
    kmp_graph *g = a->tree->graph;
    const int n = x->of->count, link = x->of->innermost;
    for (int k = a->first[link]; k < a->first[link + 1]; k++) {
        kmp_carried_row *c = &a->at[k];
        const kmp_ref share = kmp_mul(g, x->row[c->row * n + e], x->inverse[e]);
        add_multiple(g, &c->force, share, &column_at(x, link)[e]);
        for (int f = 0; f < e; f++) {
            kmp_ref *other = &x->row[c->row * n + f];
            *other = kmp_sub(g, *other, kmp_mul(g, x->inertia[e * n + f], share));
        }
        for (int h = k; h < a->first[link + 1]; h++) {
            const kmp_ref product = kmp_mul(g, share, x->row[a->at[h].row * n + e]);
            add_coupling(a, c->row, a->at[h].row, product);
            if (h == k)
                a->diagonal[c->row] = kmp_add(g, a->diagonal[c->row], product);
        }
    }
}

/* Eliminates the coordinates of a flexible body, the last one first. The motion that moves no mass; -1: none. */
static int eliminate_elastic(kmp_articulated *a, const kmp_articulated_elastic *x, inertia *r)
{
    kmp_graph *g = a->tree->graph;
    const int n = x->of->count, link = x->of->innermost;
    kmp_wrench *column = column_at(x, link);
    for (int k = a->first[link]; k < a->first[link + 1]; k++)
        for (int e = 0; e < n; e++) {
            const int row = a->at[k].row;
            const kmp_ref own = a->carried.jacobian[(ptrdiff_t)row * a->tree->model->motion_count + x->of->first + e];
            kmp_ref *sum = &x->row[row * n + e];
            *sum = kmp_add(g, *sum, kmp_mul(g, a->carried.kept[row], own));
        }
    for (int e = n; e-- > 0;) {
        if (x->inertia[e * n + e] == KMP_ZERO)
            return x->of->first + e;
        x->inverse[e] = kmp_div(g, KMP_ONE, x->inertia[e * n + e]);
        const kmp_wrench part = {kmp_vec_scale(g, x->inverse[e], column[e].force),
                                 kmp_vec_scale(g, x->inverse[e], column[e].moment)};
        subtract_product(g, r, &column[e], &part);
        reduce_rows(a, x, e);
        for (int f = 0; f < e; f++) {
            const kmp_ref share = kmp_mul(g, x->inertia[e * n + f], x->inverse[e]);
            add_multiple(g, &column[f], kmp_neg(share), &column[e]);
            for (int h = 0; h <= f; h++)
                x->inertia[f * n + h] = kmp_sub(g, x->inertia[f * n + h], kmp_mul(g, share, x->inertia[e * n + h]));
        }
    }
    return -1;
}

/* A link that coordinates of a flexible body move, or its frame; it has no motion. -1, or the motion that
 * moves no mass. */
static int pass_elastic(kmp_articulated *a, int i, inertia *r)
{
    const kmp_tree *tree = a->tree;
    kmp_articulated_elastic *x = &a->elastic[a->region[i] - 1];
    const kmp_link *link = &tree->links[i];
    if (i == x->frame)
        kmp_flexible_own(tree, x->of, column_at(x, i), x->inertia);
    if (link->guide) {
        const kmp_wrench unit = {
            .moment = link->rotation ? tensor_column(r->k, link->axis) : kmp_vec_of_column(&r->h, link->axis),
            .force = link->rotation ? kmp_vec_of_row(&r->h, link->axis) : tensor_column(r->a, link->axis)};
        guide_rows(a, x, i);
        kmp_flexible_guide(tree, i, &unit, column_at(x, i), x->inertia);
    }
    if (i == x->of->innermost)
        return eliminate_elastic(a, x, r);
    for (int e = 0; e < x->of->count; e++)
        kmp_wrench_to_parent(tree, i, column_at(x, i)[e], &column_at(x, link->parent)[e]);
    return -1;
}

/* Rows at a link without a motion continue as they are. */
static void pass_rows(kmp_articulated *a, int i)
{
    const int parent = a->tree->links[i].parent;
    for (int e = a->first[i]; e < a->first[i + 1]; e++)
        if (a->home[a->at[e].row] != i)
            kmp_wrench_to_parent(a->tree, i, a->at[e].force, &row_at(a, parent, a->at[e].row)->force);
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

/* The links of each flexible body: from its stations to the innermost one. */
static bool place_elastic(kmp_articulated *a)
{
    const kmp_tree *tree = a->tree;
    kmp_graph *g = tree->graph;
    for (int k = 0; k < tree->model->flexible_count; k++) {
        const kmp_flexible *flexible = &tree->model->flexibles[k];
        kmp_articulated_elastic *x = &a->elastic[k];
        x->frame = tree->mounts[flexible->body].link;
        x->of = tree->links[x->frame].deformation;
        const int n = x->of->count;
        if (!KMP_GRAPH_MAKE(g, KMP_ROOM(kmp_wrench, n * tree->count, &x->at), KMP_ROOM(kmp_ref, n * n, &x->inertia),
                            KMP_ROOM(kmp_ref, n, &x->inverse, &x->force),
                            KMP_ROOM(kmp_ref, n * a->carried.rows, &x->row)))
            return false;
        for (int s = -1; s < flexible->station_count; s++)
            for (int i = s < 0 ? x->frame : tree->stations[k][s]; a->region[i] == 0; i = tree->links[i].parent) {
                a->region[i] = k + 1;
                if (i == x->of->innermost)
                    break;
            }
    }
    return true;
}

static bool allocate(kmp_articulated *a)
{
    kmp_graph *g = a->tree->graph;
    const int rows = a->carried.rows;
    return KMP_GRAPH_MAKE(g, KMP_ROOM(kmp_ref, a->tree->count, &a->inverse),
                          KMP_ROOM(kmp_wrench, a->tree->count, &a->passed, &a->down),
                          KMP_ROOM(kmp_ref, rows, &a->pivot, &a->diagonal, &a->over, &a->left),
                          KMP_ROOM(kmp_ref, (size_t)rows * (size_t)rows, &a->coupling),
                          KMP_ROOM(kmp_articulated_elastic, a->tree->model->flexible_count, &a->elastic),
                          KMP_ROOM(int, a->tree->count, &a->region)) &&
           place_elastic(a) && place_rows(a);
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
        if (a->region[i] > 0) {
            const int massless = pass_elastic(a, i, &r[i]);
            if (!kmp_graph_failed(g) && massless >= 0)
                return fail_massless(tree->model, massless);
        }
        if (tree->links[i].motion < 0) {
            pass_rows(a, i);
            if (tree->links[i].parent > 0)
                add_to_parent(tree, i, r[i], &r[tree->links[i].parent]);
            continue;
        }
        a->inverse[i] = release(tree, i, &r[i], &a->passed[i]);
        if (!kmp_graph_failed(g) && a->inverse[i] == KMP_ZERO)
            return fail_massless(tree->model, tree->links[i].motion);
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

/* The load of a link that coordinates of a flexible body move on these, and at the innermost one theirs on the link. */
static void load_elastic(kmp_articulated *a, int i, const kmp_ref *effort, kmp_wrench *w)
{
    kmp_graph *g = a->tree->graph;
    kmp_articulated_elastic *x = &a->elastic[a->region[i] - 1];
    const kmp_link *link = &a->tree->links[i];
    const int n = x->of->count;
    for (int e = 0; link->guide && e < n; e++)
        x->force[e] = kmp_sub(g, x->force[e], kmp_mul(g, link->guide->slope[e], *kmp_wrench_along(link, w)));
    for (int e = n; i == x->of->innermost && e-- > 0;) {
        x->force[e] = kmp_add(g, x->force[e], effort ? effort[x->of->first + e] : KMP_ZERO);
        const kmp_ref part = kmp_mul(g, x->inverse[e], x->force[e]);
        add_multiple(g, w, part, &column_at(x, i)[e]);
        for (int f = 0; f < e; f++)
            x->force[f] = kmp_sub(g, x->force[f], kmp_mul(g, x->inertia[e * n + f], part));
        for (int k = a->first[i]; k < a->first[i + 1]; k++) {
            const int row = a->at[k].row;
            a->left[row] = kmp_add(g, a->left[row], kmp_mul(g, x->row[row * n + e], part));
        }
    }
}

static bool is_innermost(const kmp_articulated *a, int i)
{
    return a->region[i] > 0 && i == a->elastic[a->region[i] - 1].of->innermost;
}

/* Accelerations of a flexible body's coordinates from the acceleration of the innermost link before it moves by them.
 */
static void accelerate_elastic(const kmp_articulated *a, int i, const kmp_wrench *m,
                               const kmp_articulated_result *result)
{
    kmp_graph *g = a->tree->graph;
    const kmp_articulated_elastic *x = &a->elastic[a->region[i] - 1];
    const int n = x->of->count;
    for (int e = 0; e < n; e++) {
        const kmp_wrench *column = &column_at(x, i)[e];
        kmp_ref sum = kmp_sub(g, x->force[e], kmp_vec_dot(g, column->moment, m->moment));
        sum = kmp_sub(g, sum, kmp_vec_dot(g, column->force, m->force));
        for (int f = 0; f < e; f++)
            sum = kmp_sub(g, sum, kmp_mul(g, x->inertia[e * n + f], result->qdd[x->of->first + f]));
        if (result->open)
            result->open[x->of->first + e] = kmp_mul(g, sum, x->inverse[e]);
        for (int k = a->first[i]; k < a->first[i + 1]; k++) {
            const int row = a->at[k].row;
            sum = kmp_add(g, sum, kmp_mul(g, x->row[row * n + e], result->lambda[row]));
        }
        result->qdd[x->of->first + e] = kmp_mul(g, sum, x->inverse[e]);
    }
}

/* The generalized force left for each joint's own acceleration, in `qdd`, and the load on its parent. */
static void sweep_inwards(kmp_articulated *a, const kmp_ref *effort, kmp_ref *qdd)
{
    const kmp_tree *tree = a->tree;
    kmp_graph *g = tree->graph;
    for (int i = tree->count - 1; i > 0; i--) {
        const kmp_link *link = &tree->links[i];
        const int motion = link->motion;
        leave_curves(a, i);
        kmp_wrench w = a->down[i], *passed = &a->passed[i];
        if (a->region[i] > 0)
            load_elastic(a, i, effort, &w);
        if (motion < 0) {
            if (link->parent > 0)
                kmp_wrench_to_parent(tree, i, w, &a->down[link->parent]);
            continue;
        }
        kmp_ref own = effort ? effort[motion] : KMP_ZERO, *along = kmp_wrench_along(link, &w);
        own = link->reversed ? kmp_neg(own) : own;
        qdd[motion] = kmp_sub(g, own, *along);
        for (int e = a->first[i]; e < a->first[i + 1]; e++)
            if (a->home[a->at[e].row] != i)
                a->left[a->at[e].row] = kmp_add(g, a->left[a->at[e].row], kmp_mul(g, a->at[e].share, qdd[motion]));
        w.moment = kmp_vec_add(g, w.moment, kmp_vec_scale(g, qdd[motion], passed->moment));
        w.force = kmp_vec_add(g, w.force, kmp_vec_scale(g, qdd[motion], passed->force));
        if (link->armature == KMP_ZERO)
            *along = own;
        if (link->parent > 0)
            kmp_wrench_to_parent(tree, i, w, &a->down[link->parent]);
    }
    leave_curves(a, 0);
}

/* The acceleration of link i, where its own motion has none, from its parent's. */
static kmp_wrench carried_acceleration(const kmp_tree *tree, int i, const kmp_wrench *h)
{
    kmp_graph *g = tree->graph;
    const kmp_link *link = &tree->links[i];
    kmp_wrench m;
    m.moment = kmp_link_to_child(tree, i, h->moment);
    m.force = kmp_link_to_child(tree, i, kmp_vec_add(g, h->force, kmp_vec_cross(g, h->moment, link->p)));
    m.force = kmp_vec_add(g, m.force, kmp_vec_cross(g, m.moment, kmp_link_slide(tree, i)));
    return m;
}

/* Of a link without a motion: with the motion of its guide. */
static void pass_acceleration(const kmp_articulated *a, int i, const kmp_articulated_result *result)
{
    kmp_graph *g = a->tree->graph;
    const kmp_link *link = &a->tree->links[i];
    kmp_wrench *m = &a->down[i];
    *m = carried_acceleration(a->tree, i, &a->down[link->parent]);
    if (is_innermost(a, i))
        accelerate_elastic(a, i, m, result);
    kmp_ref *along = kmp_wrench_along(link, m);
    for (int e = 0; link->guide && e < link->guide->count; e++)
        *along = kmp_add(g, *along, kmp_mul(g, link->guide->slope[e], result->qdd[link->guide->first + e]));
    find_multipliers(a, i, m, result->lambda);
}

/* Accelerations relative to qdd = 0; `moment` is the angular one, `force` the one of the origin. */
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
        const int motion = link->motion;
        if (motion < 0) {
            pass_acceleration(a, i, result);
            continue;
        }
        kmp_ref pushed = KMP_ZERO; /* by multipliers */
        for (int e = a->first[i]; e < a->first[i + 1]; e++)
            if (a->home[a->at[e].row] != i)
                pushed = kmp_add(g, pushed, kmp_mul(g, a->at[e].share, result->lambda[a->at[e].row]));
        if (a->first[i] == a->first[i + 1] && a->region[i] == 0 && rests(g, h, qdd[motion])) {
            m[i] = *h;
            if (result->open)
                result->open[motion] = qdd[motion];
            continue;
        }
        m[i] = carried_acceleration(tree, i, h);
        kmp_ref along =
            kmp_add(g, kmp_vec_dot(g, passed->moment, m[i].moment), kmp_vec_dot(g, passed->force, m[i].force));
        kmp_ref open = kmp_sub(g, kmp_mul(g, a->inverse[i], qdd[motion]), along), *x = kmp_wrench_along(link, &m[i]);
        kmp_ref total = kmp_add(g, open, pushed);
        bool geared = link->armature != KMP_ZERO; /* its own acceleration is a part of `along` then */
        qdd[motion] = geared ? total : kmp_sub(g, total, *x);
        open = geared ? open : kmp_sub(g, open, *x);
        *x = geared ? kmp_add(g, *x, total) : total;
        if (link->reversed)
            qdd[motion] = kmp_neg(qdd[motion]);
        if (result->open)
            result->open[motion] = link->reversed ? kmp_neg(open) : open;
        if (is_innermost(a, i))
            accelerate_elastic(a, i, &m[i], result);
        find_multipliers(a, i, &m[i], result->lambda);
    }
}

void kmp_articulated_solve(kmp_articulated *a, const kmp_ref *effort, const kmp_wrench *share, const kmp_ref *curve,
                           const kmp_articulated_result *result)
{
    for (int i = 0; i < a->tree->count; i++)
        a->down[i] = share ? share[i] : (kmp_wrench){kmp_vec_zero(), kmp_vec_zero()};
    for (int k = 0; k < a->tree->model->flexible_count; k++)
        for (int e = 0; e < a->elastic[k].of->count; e++)
            a->elastic[k].force[e] = KMP_ZERO;
    for (int r = 0; r < a->carried.rows; r++)
        a->left[r] = kmp_mul(a->tree->graph, a->carried.kept[r], curve[r]);
    sweep_inwards(a, effort, result->qdd);
    sweep_outwards(a, result);
}
