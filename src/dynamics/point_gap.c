/* SPDX-License-Identifier: BSD-3-Clause */
/* Variants of a point's position, its rates, and rows of J:
 *
 *   derived    d with runs of parallel axes merged, everything else by differentiation: best in the plane
 *   inward     from the point to the common ancestor, joint by joint: x, v = x', a = x'' at qdd = 0 in local axes,
 *              v' = R (v + qd e x x), a' = R (a + qd e x (v + v + qd e x x)); J = e.(r x f) with f, the gradient of the
 *              row by d, rotated outwards
 *   outward    from the ancestor in its axes: axes, origins, rates and beta = wd~ + w~ w~ of the links, shared by all
 *              points on them
 *
 * With g = dh/dd, d from point to point, a row's J is g.(dd/dq); hdot = g.v + h_t; jdqd follows from hdot by d -> v,
 * v -> a. The cheapest single variant for all points is taken, then the cheapest closure by closure. */
#include "dynamics/point_gap.h"
#include "constraints/kinds/kind.h"
#include "dynamics/equations.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/closure.h"
#include "model/data/flexible.h"
#include "symbolic/cost.h"
#include "symbolic/derivative.h"
#include "symbolic/substitute.h"
#include "symbolic/trig.h"
#include <string.h>

/* The time of the search grows with the square of their number: larger mechanisms use derived rows, as do mechanisms
 * with flexible bodies. */
enum { MOST_CLOSURES = 64, MOST_PASSES = 3 };

typedef enum gap_variant { DERIVED, INWARD, OUTWARD, VARIANTS } gap_variant;

/* Parts of a row that are exchanged together. */
typedef enum gap_part { PLACE, RATE, PARTS } gap_part; /* h and J; hdot and jdqd */

/* A link relative to an ancestor, in the ancestor's axes. */
typedef struct gap_seen {
    bool known;
    kmp_vec axes[3], origin, v, a, w, wd;
    kmp_matrix beta;
} gap_seen;

/* The motion of a point from an ancestor. */
typedef struct gap_motion {
    kmp_vec x, v, a;
} gap_motion;

/* One of the two points. */
typedef struct gap_side {
    int ancestor, link; /* the common ancestor of both points; the point's link */
    kmp_vec local;      /* from the link's origin */
    gap_motion by[VARIANTS];
    kmp_vec *column; /* n: dx/dq, derived */
} gap_side;

/* The rows of a closure with either side by one of the variants. */
typedef struct gap_version {
    bool known[PARTS];
    kmp_ref *place; /* h, then J by rows */
    kmp_ref *rate;  /* hdot, then jdqd */
} gap_version;

typedef struct gap {
    int closure, row, count; /* the rows of the closure */
    gap_side side[2];
    bool moves[3]; /* components of d that depend on coordinates */
    kmp_vec d;
    gap_variant chosen[PARTS][2];
    gap_version version[VARIANTS][VARIANTS];
} gap;

typedef struct gaps {
    kmp_equations *eq;
    unsigned sets;
    gap *list;
    int count;
    int view; /* ancestor that `seen` belongs to */
    gap_seen *seen;
    kmp_vec *arm; /* from each link's origin to the current point, link axes */
    int *path;
    kmp_derivative *derivative; /* along one direction after the other */
} gaps;

/* -- inward ------------------------------------------------------------------------------------------ */

/* w e x u for a unit axis. */
static kmp_vec turn_rate(kmp_graph *g, kmp_ref w, int axis, kmp_vec u)
{
    kmp_vec r = kmp_vec_zero();
    int i = (axis + 1) % 3, j = (axis + 2) % 3;
    r.x[i] = kmp_neg(kmp_mul(g, w, u.x[j]));
    r.x[j] = kmp_mul(g, w, u.x[i]);
    return r;
}

/* The motion of the point, and the arm of each joint; without `rates` only the position. */
static gap_motion move_inward(gaps *s, const gap_side *p, bool rates)
{
    const kmp_tree *tree = &s->eq->tree;
    kmp_graph *g = tree->graph;
    gap_motion m = {p->local, kmp_vec_zero(), kmp_vec_zero()};
    for (int i = p->link; i != p->ancestor; i = tree->links[i].parent) {
        const kmp_link *link = &tree->links[i];
        s->arm[i] = m.x;
        if (!link->rotation)
            m.x = kmp_vec_add(g, m.x, kmp_link_slide(tree, i));
        if (rates && !link->rotation)
            m.v = kmp_vec_add(g, m.v, kmp_vec_axis(link->qd, link->axis));
        if (rates && link->rotation) {
            kmp_vec before = m.v;
            m.v = kmp_vec_add(g, m.v, turn_rate(g, link->qd, link->axis, m.x));
            m.a = kmp_vec_add(g, m.a, turn_rate(g, link->qd, link->axis, kmp_vec_add(g, before, m.v)));
        }
        m.x = kmp_vec_add(g, kmp_link_to_parent(tree, i, m.x), link->p);
        if (!rates)
            continue;
        m.v = kmp_link_to_parent(tree, i, m.v);
        m.a = kmp_link_to_parent(tree, i, m.a);
    }
    return m;
}

/* One row of J for one of the points, with f the row's gradient by its position. Entries are velocities of the point
 * by each joint's motion, along f in the ancestor's axes. */
static void row_inward(gaps *s, const gap_side *p, kmp_vec f, kmp_ref *row)
{
    const kmp_tree *tree = &s->eq->tree;
    kmp_graph *g = tree->graph;
    int depth = 0;
    (void)move_inward(s, p, false); /* the arms */
    for (int i = p->link; i != p->ancestor; i = tree->links[i].parent)
        s->path[depth++] = i;
    while (depth--) {
        int k = s->path[depth];
        const kmp_link *link = &tree->links[k];
        f = kmp_link_to_child(tree, k, f);
        kmp_ref along = link->rotation ? kmp_vec_cross(g, s->arm[k], f).x[link->axis] : f.x[link->axis];
        row[k - 1] = link->reversed ? kmp_neg(along) : along;
    }
}

/* -- outward ----------------------------------------------------------------------------------------- */

static void see(gaps *s, int i)
{
    const kmp_tree *tree = &s->eq->tree;
    kmp_graph *g = tree->graph;
    const kmp_link *link = &tree->links[i];
    if (s->seen[i].known)
        return;
    see(s, link->parent);
    const gap_seen *h = &s->seen[link->parent];
    gap_seen *m = &s->seen[i];
    m->known = true;
    /* The link's axes in the ancestor's from its parent's: the constant rotation, then the joint's. */
    int p = (link->axis + 1) % 3, q = (link->axis + 2) % 3;
    memcpy(m->axes, h->axes, sizeof m->axes);
    for (int k = 0; link->turned && k < 3; k++) {
        kmp_vec column;
        for (int j = 0; j < 3; j++)
            column.x[j] = kmp_link_axes(tree, i, j, k);
        m->axes[k] = kmp_vec_along(g, column.x, h->axes);
    }
    for (int n = 0; link->rotation && n < 3; n++)
        kmp_rotate(g, kmp_neg(link->q), &m->axes[p].x[n], &m->axes[q].x[n]);
    kmp_vec axis = m->axes[link->axis], r = kmp_vec_along(g, link->p.x, h->axes),
            rate = kmp_vec_scale(g, link->qd, axis);
    if (!link->rotation)
        r = kmp_vec_add(g, r, kmp_vec_scale(g, link->q, axis));
    m->origin = kmp_vec_add(g, h->origin, r);
    m->v = kmp_vec_add(g, h->v, kmp_vec_cross(g, h->w, r));
    m->a = kmp_vec_add(g, h->a, kmp_matrix_apply(g, &h->beta, false, r));
    m->w = h->w;
    m->wd = h->wd;
    m->beta = h->beta;
    if (link->rotation) {
        m->w = kmp_vec_add(g, m->w, rate);
        m->wd = kmp_vec_add(g, m->wd, kmp_vec_cross(g, h->w, rate));
        for (int n = 0; n < 3; n++) { /* beta = wd~ + w~ w~ */
            int j = (n + 1) % 3, k = (n + 2) % 3;
            kmp_ref wj = m->w.x[j], wk = m->w.x[k], ww = kmp_mul(g, m->w.x[n], wj);
            m->beta.x[n][n] = kmp_neg(kmp_add(g, kmp_mul(g, wj, wj), kmp_mul(g, wk, wk)));
            m->beta.x[n][j] = kmp_sub(g, ww, m->wd.x[k]);
            m->beta.x[j][n] = kmp_add(g, ww, m->wd.x[k]);
        }
    } else {
        m->v = kmp_vec_add(g, m->v, rate);
        m->a = kmp_vec_add(g, m->a, kmp_vec_scale(g, kmp_const(g, 2), kmp_vec_cross(g, h->w, rate)));
    }
}

/* The links of the point relative to its ancestor. */
static void look_from_ancestor(gaps *s, const gap_side *p)
{
    if (s->view != p->ancestor) {
        memset(s->seen, 0, (size_t)s->eq->tree.count * sizeof *s->seen);
        s->view = p->ancestor;
        s->seen[s->view].known = true;
        for (int k = 0; k < 3; k++)
            s->seen[s->view].axes[k] = kmp_vec_axis(KMP_ONE, k);
    }
    see(s, p->link);
}

/* True if another joint between ancestor and point turns about an axis through the same point. */
static bool is_concurrent(const gaps *s, const gap_side *p, int k)
{
    for (int i = p->link; i != p->ancestor; i = s->eq->tree.links[i].parent)
        if (i != k && s->eq->tree.links[i].rotation &&
            (s->seen[i].origin.x[0] == s->seen[k].origin.x[0] && s->seen[i].origin.x[1] == s->seen[k].origin.x[1] &&
             s->seen[i].origin.x[2] == s->seen[k].origin.x[2]))
            return true;
    return false;
}

/* f.(e x (x - o)). The moment (x - o) x f is shared by joints whose axes meet. For others, unless f is an axis, e.(x x
 * f) - f.(e x o), where e x o is shared by all points. */
static void row_outward(gaps *s, const gap_side *p, kmp_vec f, kmp_ref *row)
{
    const kmp_tree *tree = &s->eq->tree;
    kmp_graph *g = tree->graph;
    kmp_vec x = p->by[OUTWARD].x, moment = kmp_vec_cross(g, x, f);
    look_from_ancestor(s, p);
    int numbers = 0; /* f is an axis where all its components are 0, 1 or -1 */
    for (int k = 0; k < 3; k++)
        numbers += f.x[k] == KMP_ZERO || (f.x[k] | 1) == (KMP_ONE | 1);
    for (int k = p->link; k != p->ancestor; k = tree->links[k].parent) {
        const kmp_link *link = &tree->links[k];
        const gap_seen *m = &s->seen[k];
        kmp_vec e = m->axes[link->axis];
        kmp_ref along;
        if (!link->rotation)
            along = kmp_vec_dot(g, f, e);
        else if (numbers == 3 || is_concurrent(s, p, k))
            along = kmp_vec_dot(g, e, kmp_vec_cross(g, kmp_vec_sub(g, x, m->origin), f));
        else
            along = kmp_sub(g, kmp_vec_dot(g, e, moment), kmp_vec_dot(g, f, kmp_vec_cross(g, e, m->origin)));
        row[k - 1] = link->reversed ? kmp_neg(along) : along;
    }
}

/* -- derived ----------------------------------------------------------------------------------------- */

static void row_derived(gaps *s, const gap_side *p, kmp_vec f, kmp_ref *row)
{
    const kmp_tree *tree = &s->eq->tree;
    for (int k = p->link; k != p->ancestor; k = tree->links[k].parent)
        row[k - 1] = kmp_vec_dot(tree->graph, f, p->column[k - 1]);
}

/* Differentiation along a direction, valid until the next call; owned by s. NULL: no memory. */
static kmp_derivative *derivative_along(gaps *s, int count, const kmp_ref *leaf, const kmp_ref *direction)
{
    if (!s->derivative)
        s->derivative = kmp_derivative_new(s->eq->graph, count, leaf, direction);
    else if (!kmp_derivative_restart(s->derivative, count, leaf, direction))
        return NULL;
    return s->derivative;
}

/* dx/dq of all sides, and their rates, by differentiation. */
static void derive_sides(gaps *s)
{
    kmp_equations *eq = s->eq;
    kmp_derivative *dt = kmp_time_derivative(&eq->tree);
    for (int i = 0; i < 2 * s->count; i++) {
        gap_motion *m = &s->list[i / 2].side[i % 2].by[DERIVED];
        for (int k = 0; k < 3; k++) {
            m->v.x[k] = kmp_derivative_of(dt, m->x.x[k]);
            m->a.x[k] = kmp_derivative_of(dt, m->v.x[k]);
        }
    }
    kmp_derivative_free(dt);
    for (int k = 1; k < eq->tree.count; k++) {
        kmp_ref leaf = kmp_input(eq->graph, KMP_IN_Q, (uint32_t)k - 1), one = KMP_ONE;
        kmp_derivative *d = derivative_along(s, 1, &leaf, &one);
        for (int i = 0; i < 2 * s->count; i++) {
            gap_side *p = &s->list[i / 2].side[i % 2];
            bool on_path = k > p->ancestor && kmp_tree_is_above(&eq->tree, k, p->link);
            for (int j = 0; on_path && j < 3; j++)
                p->column[k - 1].x[j] = kmp_derivative_of(d, p->by[DERIVED].x.x[j]);
        }
    }
}

/* -- rows by variants of either point ------------------------------------------------------------------ */

/* The number of references of a closure's PLACE part: h, and J by rows. */
static int place_count(const gaps *s, const gap *p)
{
    return p->count * (s->eq->n + 1);
}

/* Variable components of d, as leaves without sign, with the values that replace them; returns their number. */
static int gap_leaves(const gap *p, const kmp_vec *values, kmp_ref leaf[3], kmp_ref to[3])
{
    int count = 0;
    for (int k = 0; k < 3; k++)
        if (p->moves[k]) {
            leaf[count] = p->d.x[k] & ~(kmp_ref)1;
            to[count++] = kmp_is_negative(p->d.x[k]) ? kmp_neg(values->x[k]) : values->x[k];
        }
    return count;
}

/* True if rows h depend on coordinates only through d, whose components are different nodes. */
static bool is_seen_through(gaps *s, const gap *p, const kmp_ref *h)
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
static void rates(gaps *s, const gap *p, const kmp_ref *h, kmp_vec v, kmp_vec a, kmp_ref *rate)
{
    kmp_graph *g = s->eq->graph;
    int room = 6 + kmp_tree_time_leaf_count(&s->eq->tree);
    kmp_ref *leaf = KMP_GRAPH_NEW(g, kmp_ref, 2 * room);
    if (!leaf)
        return;
    kmp_ref *to = leaf + room;
    int times = kmp_tree_time_leaves(&s->eq->tree, leaf, to);
    int first = times + gap_leaves(p, &v, leaf + times, to + times), count = first;
    kmp_derivative *d = derivative_along(s, first, leaf, to);
    for (int r = 0; r < p->count; r++)
        rate[r] = kmp_derivative_of(d, h[r]);
    for (int k = 0; k < 3; k++)
        if (p->moves[k] && kmp_graph_node(g, kmp_id(v.x[k]))->op != KMP_OP_CONST) {
            leaf[count] = v.x[k] & ~(kmp_ref)1;
            to[count++] = kmp_is_negative(v.x[k]) ? kmp_neg(a.x[k]) : a.x[k];
        }
    d = derivative_along(s, count, leaf, to);
    for (int r = 0; r < p->count; r++)
        rate[p->count + r] = kmp_derivative_of(d, rate[r]);
}

/* Both points by their variants: d, and h of it. They are unchanged where constants of d and of h have merged, so that
 * h is not a function of d any more. */
static void place_points(gaps *s, const gap *p, const gap_variant by[2], gap *placed, kmp_ref *h)
{
    kmp_graph *g = s->eq->graph;
    kmp_ref leaf[3] = {0}, to[3] = {0};
    uint16_t through;
    *placed = *p;
    placed->d = kmp_vec_sub(g, p->side[1].by[by[1]].x, p->side[0].by[by[0]].x);
    int count = gap_leaves(p, &placed->d, leaf, to);
    memcpy(h, s->eq->closures.h + p->row, (size_t)p->count * sizeof *h);
    for (int k = 0; k < 3; k++)
        placed->moves[k] = p->moves[k] && kmp_graph_node(g, kmp_id(placed->d.x[k]))->op != KMP_OP_CONST;
    if (!kmp_substitute(g, count, leaf, to, p->count, h, &through))
        kmp_graph_fail(g);
    if (!is_seen_through(s, placed, h)) {
        *placed = *p;
        memcpy(h, s->eq->closures.h + p->row, (size_t)p->count * sizeof *h);
    }
}

static void derive_part(gaps *s, const gap *p, gap_part what, const gap_variant by[2], gap_version *v)
{
    kmp_graph *g = s->eq->graph;
    kmp_ref h[KMP_KIND_MAX_ROWS];
    kmp_vec gradient[KMP_KIND_MAX_ROWS];
    gap placed;
    const gap_motion *first = &p->side[0].by[by[0]], *second = &p->side[1].by[by[1]];
    kmp_ref **part = what == RATE ? &v->rate : &v->place;
    *part = KMP_GRAPH_NEW(g, kmp_ref, what == RATE ? 2 * p->count : place_count(s, p));
    if (!*part)
        return;
    place_points(s, p, by, &placed, h);
    if (what == RATE) {
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
        kmp_derivative *d = derivative_along(s, 1, &leaf, &one);
        for (int r = 0; r < placed.count; r++)
            gradient[r].x[k] = kmp_derivative_of(d, h[r]);
    }
    memcpy(v->place, h, (size_t)p->count * sizeof *h);
    kmp_ref *rows = v->place + p->count;
    void (*const row_of[VARIANTS])(gaps *, const gap_side *, kmp_vec, kmp_ref *) = {row_derived, row_inward,
                                                                                    row_outward};
    for (int r = 0; r < p->count; r++)
        for (int k = 0; k < 2; k++) { /* d = second point - first */
            kmp_vec f = k == 1 ? gradient[r] : kmp_vec_sub(g, kmp_vec_zero(), gradient[r]);
            row_of[by[k]](s, &p->side[k], f, rows + r * s->eq->n);
        }
}

/* The closure's rows with its sides by two variants, derived when first used; NULL: no memory. */
static const gap_version *version_of(gaps *s, gap *p, gap_part what, const gap_variant by[2])
{
    gap_version *v = &p->version[by[0]][by[1]];
    if (!kmp_graph_failed(s->eq->graph) && !v->known[what]) {
        v->known[what] = true;
        derive_part(s, p, what, by, v);
    }
    return kmp_graph_failed(s->eq->graph) ? NULL : v;
}

/* -- choice of closures ------------------------------------------------------------------------------ */

static void add_gap(gaps *s, int row, int count)
{
    kmp_equations *eq = s->eq;
    const kmp_closure *closure = kmp_model_closure(eq->model, eq->closures.rows[row].closure);
    gap p = {.closure = eq->closures.rows[row].closure, .row = row, .count = count};
    int ancestor;
    if (closure->point[0] < 0 || closure->point[1] < 0)
        return;
    p.d = kmp_point_difference(&eq->tree, closure->point[0], closure->point[1], &ancestor);
    for (int k = 0; k < 3; k++)
        p.moves[k] = kmp_depends_on(eq->graph, p.d.x[k], KMP_IN_Q);
    if (!is_seen_through(s, &p, eq->closures.h + row))
        return;
    for (int k = 0; k < 2; k++) {
        gap_side *point = &p.side[k];
        *point = (gap_side){.ancestor = ancestor,
                            .link = kmp_point_link(&eq->tree, closure->point[k]),
                            .local = kmp_point_local(&eq->tree, closure->point[k])};
        point->by[DERIVED].x = kmp_point_position(&eq->tree, closure->point[k], ancestor);
        point->by[INWARD] = move_inward(s, point, true);
        kmp_graph *g = s->eq->graph;
        look_from_ancestor(s, point);
        const gap_seen *m = &s->seen[point->link];
        kmp_vec r = kmp_vec_along(g, point->local.x, m->axes);
        point->by[OUTWARD] = (gap_motion){kmp_vec_add(g, m->origin, r), kmp_vec_add(g, m->v, kmp_vec_cross(g, m->w, r)),
                                          kmp_vec_add(g, m->a, kmp_matrix_apply(g, &m->beta, false, r))};
        point->column = KMP_GRAPH_NEW(eq->graph, kmp_vec, eq->n);
    }
    s->list[s->count++] = p;
}

/* -- the choice -------------------------------------------------------------------------------------- */

static bool is_requested(const gaps *s, gap_part what)
{
    const unsigned sets[PARTS] = {KMP_SET_CLOSURE | KMP_SET_RESIDUAL, KMP_SET_JDQD | KMP_SET_RESIDUAL};
    return s->sets & sets[what];
}

/* The references of the chosen version that count, and their number. NULL: none. */
static const kmp_ref *counted(gaps *s, gap *p, gap_part what, int *count)
{
    const bool hdot = s->sets & KMP_SET_RESIDUAL, jdqd = s->sets & KMP_SET_JDQD;
    const gap_version *v = is_requested(s, what) ? version_of(s, p, what, p->chosen[what]) : NULL;
    if (what == PLACE) {
        *count = place_count(s, p);
        return v ? v->place : NULL;
    }
    *count = hdot && jdqd ? 2 * p->count : p->count;
    return v ? v->rate + (hdot ? 0 : p->count) : NULL;
}

/* Only references that differ are counted: most are the zeros of J. */
static void set_variant(gaps *s, gap *p, gap_part what, kmp_cost *cost, const gap_variant by[2])
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

static void choose_all(gaps *s, kmp_cost *cost, gap_variant w)
{
    const gap_variant by[2] = {w, w};
    for (int i = 0; i < s->count; i++)
        for (gap_part what = PLACE; what < PARTS; what++)
            set_variant(s, &s->list[i], what, cost, by);
}

/* Takes the cheapest variant for either point of one part of one closure; the others are unchanged. */
static bool choose_one(gaps *s, gap *p, gap_part what, kmp_cost *cost)
{
    gap_variant best[2];
    long least = cost->operations;
    bool better = false;
    memcpy(best, p->chosen[what], sizeof best);
    for (int k = 0; k < 2 * VARIANTS; k++) {
        gap_variant by[2] = {best[0], best[1]};
        by[k / VARIANTS] = (gap_variant)(k % VARIANTS);
        if (by[k / VARIANTS] == best[k / VARIANTS])
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
static bool choose(gaps *s)
{
    kmp_cost cost;
    if (!kmp_cost_init(&cost, s->eq->graph, KMP_COST_ADDITION))
        return false;
    for (int i = 0; i < s->count; i++)
        for (gap_part what = PLACE; what < PARTS; what++) {
            int count;
            const kmp_ref *derived = counted(s, &s->list[i], what, &count);
            if (derived)
                kmp_cost_add(&cost, count, derived);
        }
    long least = cost.operations;
    gap_variant best = DERIVED;
    for (gap_variant w = INWARD; w < VARIANTS; w++) {
        choose_all(s, &cost, w);
        if (cost.operations < least) {
            least = cost.operations;
            best = w;
        }
    }
    choose_all(s, &cost, best);
    const int parts = PARTS * s->count;
    for (int k = 0, unchanged = 0; k < MOST_PASSES * parts && unchanged < parts; k++) {
        gap_part what = (gap_part)(k % PARTS);
        bool better = is_requested(s, what) && choose_one(s, &s->list[k % parts / PARTS], what, &cost);
        unchanged = better ? 0 : unchanged + 1;
    }
    bool ok = !cost.failed && !kmp_graph_failed(s->eq->graph);
    kmp_cost_free(&cost);
    return ok;
}

/* Puts a closure by variants into h, hdot, jdqd and J (of all rows); both parts are derived before either is replaced.
 * False: no memory. */
static bool put_gap(gaps *s, gap *p, gap_variant by[PARTS][2], kmp_ref *const to[4])
{
    size_t rows = (size_t)p->count * sizeof(kmp_ref);
    const gap_version *v[PARTS] = {NULL, NULL};
    for (gap_part what = PLACE; what < PARTS; what++) {
        v[what] = is_requested(s, what) ? version_of(s, p, what, by[what]) : NULL;
        if (is_requested(s, what) && !v[what])
            return false;
    }
    if (v[PLACE]) {
        memcpy(to[0] + p->row, v[PLACE]->place, rows);
        memcpy(to[3] + p->row * s->eq->n, v[PLACE]->place + p->count, (size_t)s->eq->n * rows);
    }
    if (v[RATE]) {
        memcpy(to[1] + p->row, v[RATE]->rate, rows);
        memcpy(to[2] + p->row, v[RATE]->rate + p->count, rows);
    }
    return true;
}

/* Keeps all rows unchanged, rows of point closures with both sides derived: closures.derived. */
static bool keep_derived(gaps *s)
{
    gap_variant by[PARTS][2] = {{DERIVED, DERIVED}, {DERIVED, DERIVED}};
    kmp_equations *eq = s->eq;
    size_t m = (size_t)eq->m, n = (size_t)eq->n;
    kmp_ref *all = eq->closures.derived = KMP_GRAPH_NEW(eq->graph, kmp_ref, m * (n + 3));
    if (!all)
        return false;
    kmp_ref *const to[4] = {all, all + m, all + 2 * m, all + 3 * m};
    memcpy(to[0], eq->closures.h, m * sizeof *all);
    memcpy(to[1], eq->closures.hdot, m * sizeof *all);
    memcpy(to[2], eq->closures.jdqd, m * sizeof *all);
    memcpy(to[3], eq->closures.jacobian, m * n * sizeof *all);
    for (int i = 0; i < s->count; i++)
        if (!put_gap(s, &s->list[i], by, to))
            return false;
    return !kmp_graph_failed(eq->graph);
}

/* -- the whole --------------------------------------------------------------------------------------- */

/* The variants as numbers: of h and J for either point, then of the rates. */
static uint8_t *variants_of(gaps *s, const gap *p)
{
    return s->eq->savings.point + 4 * p->closure;
}

bool kmp_gaps_shorten(kmp_equations *eq, unsigned sets, bool search)
{
    gaps s = {.eq = eq, .sets = sets, .view = -1};
    if (kmp_model_closure_count(eq->model) > MOST_CLOSURES || kmp_model_flexible_count(eq->model) > 0 ||
        (!is_requested(&s, PLACE) && !is_requested(&s, RATE)))
        return true;
    const int links = eq->tree.count;
    KMP_GRAPH_MAKE(eq->graph, KMP_ROOM(gap, kmp_model_closure_count(eq->model), &s.list),
                   KMP_ROOM(gap_seen, links, &s.seen), KMP_ROOM(kmp_vec, links, &s.arm), KMP_ROOM(int, links, &s.path));
    if (kmp_graph_failed(eq->graph))
        return false;
    for (int r = 0, count; r < eq->m; r += count) {
        for (count = 1; r + count < eq->m && eq->closures.rows[r + count].closure == eq->closures.rows[r].closure;)
            count++;
        add_gap(&s, r, count);
    }
    if (!kmp_graph_failed(eq->graph))
        derive_sides(&s);
    bool ok = !kmp_graph_failed(eq->graph);
    if (ok && search) {
        ok = s.count == 0 || (choose(&s) && keep_derived(&s));
        for (int i = 0; i < 4 * s.count; i++) {
            const gap *p = &s.list[i / 4];
            variants_of(&s, p)[i % 4] = (uint8_t)p->chosen[i % 4 / 2][i % 2];
        }
    } else if (ok) {
        for (int i = 0; i < 4 * s.count; i++) {
            gap *p = &s.list[i / 4];
            p->chosen[i % 4 / 2][i % 2] = (gap_variant)variants_of(&s, p)[i % 4];
        }
    }
    for (int i = 0; ok && i < s.count; i++)
        ok = put_gap(&s, &s.list[i], s.list[i].chosen,
                     (kmp_ref *const[]){eq->closures.h, eq->closures.hdot, eq->closures.jdqd, eq->closures.jacobian});
    kmp_derivative_free(s.derivative);
    return ok;
}
