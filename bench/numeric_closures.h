/* SPDX-License-Identifier: BSD-3-Clause */
/* Closures beside bench/numeric.h: h, J and jdqd of balls and rods, in the axes of the nearest common ancestor of both
 * points. The links between such an ancestor and all points that are seen from it are followed once, outwards:
 * axes R, origin o and its rates with the ancestor at rest, accelerations at qdd = 0. */
#ifndef KEMPE_BENCH_NUMERIC_CLOSURES_H
#define KEMPE_BENCH_NUMERIC_CLOSURES_H

#include "bench/numeric.h"
#include "dynamics/equations.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "model/data/closure.h"
#include "model/data/force.h"

typedef struct numeric_place {
    double r[3][3], axis[3]; /* of the joint, with the sign of q */
    double o[3], v[3], a[3], w[3], wd[3];
} numeric_place;

/* The links seen from an ancestor, in order. */
typedef struct numeric_view {
    int frame, count, *links;
} numeric_view;

typedef struct numeric_cut {
    int view, link[2], row[3];  /* view -1: a drive; row -1: it is not kept */
    double local[2][3], square; /* of a rod: its length's */
    bool rod;
} numeric_cut;

typedef struct numeric_closures {
    const numeric *tree;
    int view_count, cut_count;
    numeric_view *views;
    numeric_cut *cuts;
    numeric_place *places; /* of links, from the view at hand */
} numeric_closures;

static inline void numeric_closures_free(numeric_closures *c)
{
    for (int k = 0; c->views && k < c->view_count; k++)
        kmp_free(c->views[k].links);
    kmp_free(c->views);
    kmp_free(c->cuts);
    kmp_free(c->places);
    *c = (numeric_closures){0};
}

/* -- once -------------------------------------------------------------------------------------------- */

static inline void numeric_read_cut(const kmp_tree *tree, const kmp_closure *from, numeric_cut *to)
{
    double length = from->number.value;
    *to = (numeric_cut){.view = -1, .row = {-1, -1, -1}, .square = length * length};
    to->rod = from->kind == KMP_CLOSURE_rod;
    to->link[0] = -1;
    for (int side = 0; side < 2 && from->point[side] >= 0; side++) {
        kmp_vec local = kmp_point_local(tree, from->point[side]);
        to->link[side] = kmp_point_link(tree, from->point[side]);
        for (int k = 0; k < 3; k++)
            to->local[side][k] = numeric_value(tree, local.x[k]);
    }
}

static inline bool numeric_is_seen(const kmp_tree *tree, const numeric_closures *c, int view, int i)
{
    bool seen = false;
    for (int k = 0; k < c->cut_count; k++)
        for (int side = 0; side < 2; side++)
            seen = seen || (c->cuts[k].view == view && kmp_tree_is_above(tree, i, c->cuts[k].link[side]));
    return seen && i != c->views[view].frame && kmp_tree_is_above(tree, c->views[view].frame, i);
}

static inline bool numeric_add_views(numeric_closures *c, const kmp_tree *tree)
{
    for (int k = 0; k < c->cut_count; k++) {
        numeric_cut *cut = &c->cuts[k];
        if (cut->link[0] < 0)
            continue;
        int frame = kmp_tree_common(tree, cut->link[0], cut->link[1]), view = 0;
        while (view < c->view_count && c->views[view].frame != frame)
            view++;
        c->views[view].frame = frame;
        cut->view = view;
        c->view_count += view == c->view_count;
    }
    for (int view = 0; view < c->view_count; view++) {
        c->views[view].links = KMP_NEW(int, tree->count);
        if (!c->views[view].links)
            return false;
        for (int i = 1; i < tree->count; i++)
            if (numeric_is_seen(tree, c, view, i))
                c->views[view].links[c->views[view].count++] = i;
    }
    return true;
}

/* Rows as the equations keep them, those of drives left out. false: no memory, or closures of another kind. */
static inline bool numeric_closures_init(numeric_closures *c, const numeric *p, const kmp_tree *tree, int m,
                                         const kmp_row *rows)
{
    const kempe_model *model = tree->model;
    *c = (numeric_closures){.tree = p};
    c->cuts = KMP_NEW(numeric_cut, kmp_model_closure_count(model));
    c->views = KMP_NEW(numeric_view, kmp_model_closure_count(model));
    c->places = KMP_NEW(numeric_place, tree->count);
    bool ok = c->cuts && c->views && c->places;
    for (int k = 0; ok && k < kmp_model_closure_count(model); k++) {
        const kmp_closure *from = kmp_model_closure(model, k);
        bool drive = from->kind == KMP_CLOSURE_drive || from->kind == KMP_CLOSURE_lock;
        ok = drive || ((from->kind == KMP_CLOSURE_ball || from->kind == KMP_CLOSURE_rod) && !from->function);
        if (ok)
            numeric_read_cut(tree, from, &c->cuts[c->cut_count++]);
    }
    for (int r = 0; ok && r < m; r++)
        c->cuts[rows[r].closure].row[rows[r].component] = r;
    if (ok && numeric_add_views(c, tree))
        return true;
    numeric_closures_free(c);
    return false;
}

/* -- outwards ---------------------------------------------------------------------------------------- */

/* v = w x r; a = wd x r + w x v */
static inline void numeric_turning(const numeric_place *h, const double r[3], double v[3], double a[3])
{
    double own[3] = {0};
    numeric_add_cross(own, h->w, r);
    numeric_add_cross(a, h->wd, r);
    numeric_add_cross(a, h->w, own);
    for (int k = 0; k < 3; k++)
        v[k] += own[k];
}

static inline void numeric_place_axes(const numeric_link *l, const numeric_state *s, const numeric_place *h,
                                      numeric_place *to)
{
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++)
            to->r[i][j] =
                l->turned ? h->r[i][0] * l->g[0][j] + h->r[i][1] * l->g[1][j] + h->r[i][2] * l->g[2][j] : h->r[i][j];
        to->axis[i] = l->sign * to->r[i][l->x];
#define TURN(x, rotation)                                                                                              \
    if (rotation)                                                                                                      \
    numeric_about(x, s->cosine, -s->sine, to->r[i])
        NUMERIC_EACH_KIND(l->kind, TURN)
#undef TURN
    }
}

static inline void numeric_place_link(const numeric_closures *c, int i, const numeric_place *h, double qd)
{
    const numeric_link *l = &c->tree->links[i];
    const numeric_state *s = &c->tree->states[i];
    numeric_place *to = &c->places[i];
    double step[3] = {0}, rate[3];
    numeric_place_axes(l, s, h, to);
    for (int k = 0; k < 3; k++) {
        if (l->offset)
            step[k] = h->r[k][0] * l->p[0] + h->r[k][1] * l->p[1] + h->r[k][2] * l->p[2];
        if (!l->rotation)
            step[k] += s->slide * l->sign * to->axis[k];
        rate[k] = to->axis[k] * qd;
        to->o[k] = h->o[k] + step[k];
        to->v[k] = h->v[k];
        to->a[k] = h->a[k];
        to->w[k] = h->w[k];
        to->wd[k] = h->wd[k];
    }
    if (l->offset || !l->rotation)
        numeric_turning(h, step, to->v, to->a);
    if (l->rotation) {
        numeric_add_cross(to->wd, h->w, rate);
        for (int k = 0; k < 3; k++)
            to->w[k] += rate[k];
    } else {
        double coriolis[3] = {0};
        numeric_add_cross(coriolis, h->w, rate);
        for (int k = 0; k < 3; k++) {
            to->v[k] += rate[k];
            to->a[k] += 2 * coriolis[k];
        }
    }
}

static inline void numeric_see(const numeric_closures *c, const numeric_view *view, const double *qd)
{
    const numeric_link *links = c->tree->links;
    c->places[view->frame] = (numeric_place){.r = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    for (int k = 0; k < view->count; k++) {
        int i = view->links[k];
        numeric_place_link(c, i, &c->places[links[i].parent], qd[i - 1]);
    }
}

/* -- rows -------------------------------------------------------------------------------------------- */

/* State of a point: x, its velocity and its acceleration. */
static inline void numeric_point(const numeric_place *p, const double local[3], double x[3], double v[3], double a[3])
{
    double arm[3];
    for (int k = 0; k < 3; k++) {
        arm[k] = p->r[k][0] * local[0] + p->r[k][1] * local[1] + p->r[k][2] * local[2];
        x[k] = p->o[k] + arm[k];
        v[k] = p->v[k];
        a[k] = p->a[k];
    }
    numeric_turning(p, arm, v, a);
}

/* Columns of x - towards from link i to the frame, in all three directions or in that of d. */
static inline void numeric_columns(const numeric_closures *c, const numeric_cut *cut, int i, const double x[3],
                                   const double *d, double sign, double *jacobian)
{
    int n = c->tree->n, frame = c->views[cut->view].frame;
    for (; i != frame; i = c->tree->links[i].parent) {
        const numeric_place *p = &c->places[i];
        double column[3] = {p->axis[0], p->axis[1], p->axis[2]};
        if (c->tree->links[i].rotation) {
            double arm[3] = {x[0] - p->o[0], x[1] - p->o[1], x[2] - p->o[2]};
            column[0] = column[1] = column[2] = 0;
            numeric_add_cross(column, p->axis, arm);
        }
        if (d)
            jacobian[cut->row[0] * n + i - 1] = sign * (column[0] * d[0] + column[1] * d[1] + column[2] * d[2]);
        for (int k = 0; k < 3 && !d; k++)
            if (cut->row[k] >= 0)
                jacobian[cut->row[k] * n + i - 1] = sign * column[k];
    }
}

static inline void numeric_close_cut(const numeric_closures *c, const numeric_cut *cut, double *h, double *jacobian,
                                     double *jdqd)
{
    double x[2][3], v[2][3], a[2][3], d[3], sum = 0, rate = 0;
    for (int side = 0; side < 2; side++)
        numeric_point(&c->places[cut->link[side]], cut->local[side], x[side], v[side], a[side]);
    for (int k = 0; k < 3; k++) {
        double dv = v[1][k] - v[0][k], da = a[1][k] - a[0][k];
        d[k] = x[1][k] - x[0][k];
        sum += d[k] * d[k];
        rate += dv * dv + d[k] * da;
        if (!cut->rod && cut->row[k] >= 0) {
            h[cut->row[k]] = d[k];
            jdqd[cut->row[k]] = da;
        }
    }
    if (cut->rod && cut->row[0] >= 0) {
        h[cut->row[0]] = 0.5 * (sum - cut->square);
        jdqd[cut->row[0]] = rate;
    }
    for (int side = 0; side < 2 && (!cut->rod || cut->row[0] >= 0); side++)
        numeric_columns(c, cut, cut->link[side], x[side], cut->rod ? d : NULL, side ? 1 : -1, jacobian);
}

/* h, J (row r at r n; what is never an entry stays as it is) and jdqd at the q of the tree's last inverse. */
static inline void numeric_close(const numeric_closures *c, const double *qd, double *h, double *jacobian, double *jdqd)
{
    for (int view = 0; view < c->view_count; view++) {
        numeric_see(c, &c->views[view], qd);
        for (int k = 0; k < c->cut_count; k++)
            if (c->cuts[k].view == view)
                numeric_close_cut(c, &c->cuts[k], h, jacobian, jdqd);
    }
}

#endif
