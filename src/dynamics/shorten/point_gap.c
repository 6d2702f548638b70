/* SPDX-License-Identifier: BSD-3-Clause */
/* Chooses the closures that are derived again from their points, and the variant for either point: the cheapest single
 * variant for all, then closure by closure. */
#include "dynamics/shorten/point_gap_inside.h"
#include "symbolic/program/cost.h"
#include <string.h>

/* The time of the search grows with the square of their number: larger mechanisms use derived rows. */
enum { MOST_CLOSURES = 64, MOST_PASSES = 3 };

/* -- choice of closures ------------------------------------------------------------------------------ */

static void add_gap(kmp_gaps *s, int row, int count)
{
    kmp_equations *eq = s->eq;
    const kmp_closure *closure = &eq->model->closures[eq->rows[row].closure];
    kmp_gap p = {.closure = eq->rows[row].closure, .row = row, .count = count};
    int ancestor;
    if (closure->point[0] < 0 || closure->point[1] < 0)
        return;
    p.d = kmp_point_difference(&eq->tree, closure->point[0], closure->point[1], &ancestor);
    for (int k = 0; k < 3; k++)
        p.moves[k] = kmp_graph_node(eq->graph, kmp_id(p.d.x[k]))->depends & (1u << KMP_IN_Q);
    if (!kmp_gap_is_seen_through(s, &p, eq->h + row))
        return;
    for (int k = 0; k < 2; k++) {
        kmp_gap_side *point = &p.side[k];
        *point = (kmp_gap_side){.ancestor = ancestor,
                                .link = kmp_point_link(&eq->tree, closure->point[k]),
                                .local = kmp_point_local(&eq->tree, closure->point[k])};
        point->by[KMP_GAP_DERIVED].x = kmp_point_position(&eq->tree, closure->point[k], ancestor);
        point->by[KMP_GAP_INWARD] = kmp_gap_move_inward(s, point);
        point->by[KMP_GAP_OUTWARD] = kmp_gap_move_outward(s, point);
        point->column = KMP_GRAPH_NEW(eq->graph, kmp_vec, eq->n);
    }
    s->list[s->count++] = p;
}

/* -- the choice -------------------------------------------------------------------------------------- */

static bool is_requested(const kmp_gaps *s, kmp_gap_part what)
{
    const unsigned sets[KMP_GAP_PARTS] = {KMP_SET_CLOSURE | KMP_SET_RESIDUAL, KMP_SET_JDQD | KMP_SET_RESIDUAL};
    return s->sets & sets[what];
}

/* The references of the chosen version that count, and their number. NULL: none. */
static const kmp_ref *counted(kmp_gaps *s, kmp_gap *p, kmp_gap_part what, int *count)
{
    const bool hdot = s->sets & KMP_SET_RESIDUAL, jdqd = s->sets & KMP_SET_JDQD;
    const kmp_gap_version *v = is_requested(s, what) ? kmp_gap_version_of(s, p, what, p->chosen[what]) : NULL;
    if (what == KMP_GAP_PLACE) {
        *count = kmp_gap_place_count(s, p);
        return v ? v->place : NULL;
    }
    *count = hdot && jdqd ? 2 * p->count : p->count;
    return v ? v->rate + (hdot ? 0 : p->count) : NULL;
}

/* Only references that differ are counted: most are the zeros of J. */
static void set_variant(kmp_gaps *s, kmp_gap *p, kmp_gap_part what, kmp_cost *cost, const kmp_gap_variant by[2])
{
    int count;
    const kmp_ref *before = counted(s, p, what, &count);
    memcpy(p->chosen[what], by, sizeof p->chosen[what]);
    const kmp_ref *now = counted(s, p, what, &count);
    for (int k = 0; before && now && k < count; k++)
        if (before[k] != now[k]) {
            kmp_cost_add(cost, 1, &now[k]);
            kmp_cost_remove(cost, 1, &before[k]);
        }
}

static void choose_all(kmp_gaps *s, kmp_cost *cost, kmp_gap_variant w)
{
    const kmp_gap_variant by[2] = {w, w};
    for (int i = 0; i < s->count; i++)
        for (kmp_gap_part what = KMP_GAP_PLACE; what < KMP_GAP_PARTS; what++)
            set_variant(s, &s->list[i], what, cost, by);
}

/* Takes the cheapest variant for either point of one part of one closure; the others are unchanged. */
static bool choose_one(kmp_gaps *s, kmp_gap *p, kmp_gap_part what, kmp_cost *cost)
{
    kmp_gap_variant best[2];
    long least = cost->operations;
    bool better = false;
    memcpy(best, p->chosen[what], sizeof best);
    for (int k = 0; k < 2 * KMP_GAP_VARIANTS; k++) {
        kmp_gap_variant by[2] = {best[0], best[1]};
        by[k / KMP_GAP_VARIANTS] = (kmp_gap_variant)(k % KMP_GAP_VARIANTS);
        if (by[k / KMP_GAP_VARIANTS] == best[k / KMP_GAP_VARIANTS])
            continue;
        set_variant(s, p, what, cost, by);
        if (cost->operations < least) {
            least = cost->operations;
            memcpy(best, by, sizeof best);
            better = true;
        }
    }
    set_variant(s, p, what, cost, best);
    return better;
}

/* The best single variant for all, then closure by closure while it reduces the cost, a few times at most: until each
 * one has been tried since the last change. */
static bool choose(kmp_gaps *s)
{
    kmp_cost cost;
    if (!kmp_cost_init(&cost, s->eq->graph, KMP_COST_ADDITION))
        return false;
    for (int i = 0; i < s->count; i++)
        for (kmp_gap_part what = KMP_GAP_PLACE; what < KMP_GAP_PARTS; what++) {
            int count;
            const kmp_ref *derived = counted(s, &s->list[i], what, &count);
            if (derived)
                kmp_cost_add(&cost, count, derived);
        }
    long least = cost.operations;
    kmp_gap_variant best = KMP_GAP_DERIVED;
    for (kmp_gap_variant w = KMP_GAP_INWARD; w < KMP_GAP_VARIANTS; w++) {
        choose_all(s, &cost, w);
        if (cost.operations < least) {
            least = cost.operations;
            best = w;
        }
    }
    choose_all(s, &cost, best);
    const int parts = KMP_GAP_PARTS * s->count;
    for (int k = 0, unchanged = 0; k < MOST_PASSES * parts && unchanged < parts; k++) {
        kmp_gap_part what = (kmp_gap_part)(k % KMP_GAP_PARTS);
        bool better = is_requested(s, what) && choose_one(s, &s->list[k % parts / KMP_GAP_PARTS], what, &cost);
        unchanged = better ? 0 : unchanged + 1;
    }
    bool ok = !cost.failed && !kmp_graph_failed(s->eq->graph);
    kmp_cost_free(&cost);
    return ok;
}

/* Keeps all rows unchanged, those of point closures with both sides derived: eq->derived. */
static bool keep_derived(kmp_gaps *s)
{
    static const kmp_gap_variant by[2] = {KMP_GAP_DERIVED, KMP_GAP_DERIVED};
    kmp_equations *eq = s->eq;
    size_t m = (size_t)eq->m, n = (size_t)eq->n;
    kmp_ref *to = KMP_GRAPH_NEW(eq->graph, kmp_ref, m * (n + 3));
    eq->derived = to;
    if (!to)
        return false;
    memcpy(to, eq->h, m * sizeof *to);
    memcpy(to + m, eq->hdot, m * sizeof *to);
    memcpy(to + 2 * m, eq->jdqd, m * sizeof *to);
    memcpy(to + 3 * m, eq->jacobian, m * n * sizeof *to);
    for (int i = 0; i < s->count; i++) {
        kmp_gap *p = &s->list[i];
        const kmp_gap_version *place =
            is_requested(s, KMP_GAP_PLACE) ? kmp_gap_version_of(s, p, KMP_GAP_PLACE, by) : NULL;
        const kmp_gap_version *rate = is_requested(s, KMP_GAP_RATE) ? kmp_gap_version_of(s, p, KMP_GAP_RATE, by) : NULL;
        size_t row = (size_t)p->row, rows = (size_t)p->count;
        if (place) {
            memcpy(to + row, place->place, rows * sizeof *to);
            memcpy(to + 3 * m + row * n, place->place + rows, rows * n * sizeof *to);
        }
        if (rate) {
            memcpy(to + m + row, rate->rate, rows * sizeof *to);
            memcpy(to + 2 * m + row, rate->rate + rows, rows * sizeof *to);
        }
    }
    return !kmp_graph_failed(eq->graph);
}

/* Both parts are derived from the original h before either is replaced. */
static bool take(kmp_gaps *s, kmp_gap *p)
{
    kmp_equations *eq = s->eq;
    size_t rows = (size_t)p->count * sizeof(kmp_ref);
    const kmp_gap_version *v[KMP_GAP_PARTS] = {NULL, NULL};
    for (kmp_gap_part what = KMP_GAP_PLACE; what < KMP_GAP_PARTS; what++) {
        v[what] = is_requested(s, what) ? kmp_gap_version_of(s, p, what, p->chosen[what]) : NULL;
        if (is_requested(s, what) && !v[what])
            return false;
    }
    if (v[KMP_GAP_PLACE]) {
        memcpy(eq->h + p->row, v[KMP_GAP_PLACE]->place, rows);
        memcpy(eq->jacobian + p->row * eq->n, v[KMP_GAP_PLACE]->place + p->count, (size_t)eq->n * rows);
    }
    if (v[KMP_GAP_RATE]) {
        memcpy(eq->hdot + p->row, v[KMP_GAP_RATE]->rate, rows);
        memcpy(eq->jdqd + p->row, v[KMP_GAP_RATE]->rate + p->count, rows);
    }
    return true;
}

/* -- the whole --------------------------------------------------------------------------------------- */

static void collect(kmp_gaps *s)
{
    kmp_equations *eq = s->eq;
    for (int r = 0, count; r < eq->m; r += count) {
        for (count = 1; r + count < eq->m && eq->rows[r + count].closure == eq->rows[r].closure;)
            count++;
        add_gap(s, r, count);
    }
    if (!kmp_graph_failed(eq->graph))
        kmp_gap_derive_sides(s);
}

/* The variants as numbers: of h and J for either point, then of the rates. */
static uint8_t *variants_of(kmp_gaps *s, const kmp_gap *p)
{
    return s->eq->savings.point + 4 * p->closure;
}

bool kmp_gaps_shorten(kmp_equations *eq, unsigned sets, bool search)
{
    kmp_gaps s = {.eq = eq, .sets = sets, .view = -1};
    if (eq->model->closure_count > MOST_CLOSURES ||
        (!is_requested(&s, KMP_GAP_PLACE) && !is_requested(&s, KMP_GAP_RATE)))
        return true;
    s.list = KMP_GRAPH_NEW(eq->graph, kmp_gap, eq->model->closure_count);
    s.seen = KMP_GRAPH_NEW(eq->graph, kmp_gap_seen, eq->tree.count);
    s.arm = KMP_GRAPH_NEW(eq->graph, kmp_vec, eq->tree.count);
    s.path = KMP_GRAPH_NEW(eq->graph, int, eq->tree.count);
    if (kmp_graph_failed(eq->graph))
        return false;
    collect(&s);
    bool ok = !kmp_graph_failed(eq->graph);
    if (ok && search) {
        ok = s.count == 0 || (choose(&s) && keep_derived(&s));
        for (int i = 0; i < 4 * s.count; i++) {
            const kmp_gap *p = &s.list[i / 4];
            variants_of(&s, p)[i % 4] = (uint8_t)p->chosen[i % 4 / 2][i % 2];
        }
    }
    if (ok) {
        for (int i = 0; i < 4 * s.count; i++) {
            kmp_gap *p = &s.list[i / 4];
            p->chosen[i % 4 / 2][i % 2] = (kmp_gap_variant)variants_of(&s, p)[i % 4];
        }
    }
    for (int i = 0; ok && i < s.count; i++)
        ok = take(&s, &s.list[i]);
    kmp_derivative_free(s.derivative);
    return ok;
}
