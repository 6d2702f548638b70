/* SPDX-License-Identifier: BSD-3-Clause */
/* The rows of a closure with either point by one of the variants. With g = dh/dd, d from point to point, a row's J is
 * g.(dd/dq); hdot = g.v + h_t; jdqd follows from hdot by d -> v, v -> a. */
#include "constraints/kinds/kind.h"
#include "dynamics/shorten/point_gap_inside.h"
#include "symbolic/derivative.h"
#include "symbolic/substitute.h"
#include <string.h>

int kmp_gap_place_count(const kmp_gaps *s, const kmp_gap *p)
{
    return p->count * (s->eq->n + 1);
}

/* Variable components of d, as leaves without sign, with the values that replace them; returns their number. */
static int gap_leaves(const kmp_gap *p, const kmp_vec *values, kmp_ref leaf[3], kmp_ref to[3])
{
    int count = 0;
    for (int k = 0; k < 3; k++)
        if (p->moves[k]) {
            leaf[count] = p->d.x[k] & ~(kmp_ref)1;
            to[count++] = kmp_is_negative(p->d.x[k]) ? kmp_neg(values->x[k]) : values->x[k];
        }
    return count;
}

bool kmp_gap_is_seen_through(kmp_gaps *s, const kmp_gap *p, const kmp_ref *h)
{
    kmp_ref leaf[3] = {0}, to[3] = {0}, rows[KMP_KIND_MAX_ROWS];
    uint16_t through;
    int count = gap_leaves(p, &p->d, leaf, to);
    for (int k = 0; k < count; k++)
        for (int j = 0; j < k; j++)
            if (leaf[k] == leaf[j])
                return false;
    for (int k = 0; k < count; k++) /* as they are */
        to[k] = leaf[k];
    memcpy(rows, h, (size_t)p->count * sizeof *rows);
    if (!kmp_substitute(s->eq->graph, count, leaf, to, p->count, rows, &through))
        kmp_graph_fail(s->eq->graph);
    return count > 0 && !(through & (1u << KMP_IN_Q));
}

/* hdot and jdqd of rows h from the rates of d. */
static void rates(kmp_gaps *s, const kmp_gap *p, const kmp_ref *h, kmp_vec v, kmp_vec a, kmp_ref *rate)
{
    kmp_graph *g = s->eq->graph;
    int room = 6 + kmp_tree_time_leaf_count(&s->eq->tree);
    kmp_ref *leaf = KMP_GRAPH_NEW(g, kmp_ref, 2 * room);
    if (!leaf)
        return;
    kmp_ref *to = leaf + room;
    int times = kmp_tree_time_leaves(&s->eq->tree, leaf, to);
    int first = times + gap_leaves(p, &v, leaf + times, to + times), count = first;
    kmp_derivative *d = kmp_gap_along(s, first, leaf, to);
    for (int r = 0; r < p->count; r++)
        rate[r] = kmp_derivative_of(d, h[r]);
    for (int k = 0; k < 3; k++)
        if (p->moves[k] && kmp_graph_node(g, kmp_id(v.x[k]))->op != KMP_OP_CONST) {
            leaf[count] = v.x[k] & ~(kmp_ref)1;
            to[count++] = kmp_is_negative(v.x[k]) ? kmp_neg(a.x[k]) : a.x[k];
        }
    d = kmp_gap_along(s, count, leaf, to);
    for (int r = 0; r < p->count; r++)
        rate[p->count + r] = kmp_derivative_of(d, rate[r]);
}

/* Both points by their variants: d, and h of it. They are unchanged where constants of d and of h have merged, so that
 * h is no function of d any more. */
static void place_points(kmp_gaps *s, const kmp_gap *p, const kmp_gap_variant by[2], kmp_gap *placed, kmp_ref *h)
{
    kmp_graph *g = s->eq->graph;
    kmp_ref leaf[3] = {0}, to[3] = {0};
    uint16_t through;
    *placed = *p;
    placed->d = kmp_vec_sub(g, p->side[1].by[by[1]].x, p->side[0].by[by[0]].x);
    int count = gap_leaves(p, &placed->d, leaf, to);
    memcpy(h, s->eq->h + p->row, (size_t)p->count * sizeof *h);
    for (int k = 0; k < 3; k++)
        placed->moves[k] = p->moves[k] && kmp_graph_node(g, kmp_id(placed->d.x[k]))->op != KMP_OP_CONST;
    if (!kmp_substitute(g, count, leaf, to, p->count, h, &through))
        kmp_graph_fail(g);
    if (!kmp_gap_is_seen_through(s, placed, h)) {
        *placed = *p;
        memcpy(h, s->eq->h + p->row, (size_t)p->count * sizeof *h);
    }
}

static void derive_part(kmp_gaps *s, const kmp_gap *p, kmp_gap_part what, const kmp_gap_variant by[2],
                        kmp_gap_version *v)
{
    kmp_graph *g = s->eq->graph;
    kmp_ref h[KMP_KIND_MAX_ROWS];
    kmp_vec gradient[KMP_KIND_MAX_ROWS];
    kmp_gap placed;
    const kmp_gap_motion *first = &p->side[0].by[by[0]], *second = &p->side[1].by[by[1]];
    kmp_ref **part = what == KMP_GAP_RATE ? &v->rate : &v->place;
    *part = KMP_GRAPH_NEW(g, kmp_ref, what == KMP_GAP_RATE ? 2 * p->count : kmp_gap_place_count(s, p));
    if (!*part)
        return;
    place_points(s, p, by, &placed, h);
    if (what == KMP_GAP_RATE) {
        kmp_vec a = kmp_vec_sub(g, second->a, first->a);
        rates(s, &placed, h, kmp_vec_sub(g, second->v, first->v), a, v->rate);
        return;
    }
    /* dh/dd of each row. */
    for (int r = 0; r < placed.count; r++)
        gradient[r] = kmp_vec_zero();
    for (int k = 0; k < 3; k++) {
        kmp_ref leaf = placed.d.x[k] & ~(kmp_ref)1, one = kmp_is_negative(placed.d.x[k]) ? kmp_neg(KMP_ONE) : KMP_ONE;
        if (!placed.moves[k])
            continue;
        kmp_derivative *d = kmp_gap_along(s, 1, &leaf, &one);
        for (int r = 0; r < placed.count; r++)
            gradient[r].x[k] = kmp_derivative_of(d, h[r]);
    }
    memcpy(v->place, h, (size_t)p->count * sizeof *h);
    kmp_ref *rows = v->place + p->count;
    void (*const row_of[KMP_GAP_VARIANTS])(kmp_gaps *, const kmp_gap_side *, kmp_vec,
                                           kmp_ref *) = {kmp_gap_row_derived, kmp_gap_row_inward, kmp_gap_row_outward};
    for (int r = 0; r < p->count; r++)
        for (int k = 0; k < 2; k++) { /* d = second point - first */
            kmp_vec f = k == 1 ? gradient[r] : kmp_vec_sub(g, kmp_vec_zero(), gradient[r]);
            row_of[by[k]](s, &p->side[k], f, rows + r * s->eq->n);
        }
}

const kmp_gap_version *kmp_gap_version_of(kmp_gaps *s, kmp_gap *p, kmp_gap_part what, const kmp_gap_variant by[2])
{
    kmp_gap_version *v = &p->version[by[0]][by[1]];
    if (!kmp_graph_failed(s->eq->graph) && !v->known[what]) {
        v->known[what] = true;
        derive_part(s, p, what, by, v);
    }
    return kmp_graph_failed(s->eq->graph) ? NULL : v;
}
