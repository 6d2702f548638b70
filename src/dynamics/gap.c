/* SPDX-License-Identifier: BSD-3-Clause */
/* Ways to d, its rates, and J:
 *
 *   derived    d with runs of parallel axes merged, everything else by differentiation: best in the plane
 *   inward     from the point to the common ancestor, joint by joint: x, v = x', a = x'' at qdd = 0 in local axes,
 *              v' = R (v + qd e x x), a' = R (a + qd e x (v + v + qd e x x)); J = e.(r x f) with f, the gradient of the
 *              row by d, turned outwards
 *   outward    from the ancestor in its axes: axes, origins, rates and beta = wd~ + w~ w~ of the links, shared by all
 *              points on them
 *
 * With g = dh/dd a row's J is g.(dd/dq); hdot = g.v + h_t; jdqd follows from hdot by d -> v, v -> a. */
#include "dynamics/gap.h"
#include "base/memory.h"
#include "constraints/kinds/kind.h"
#include "dynamics/forces.h"
#include "symbolic/cost.h"
#include "symbolic/derivative.h"
#include "symbolic/rotation.h"
#include "symbolic/substitute.h"
#include <string.h>

/* The search takes about the square of their number: larger mechanisms are derived. */
enum { MOST_CLOSURES = 64 };

typedef enum way { WAY_DERIVED, WAY_INWARD, WAY_OUTWARD, WAYS } way;

/* What of a row is exchanged together. */
typedef enum part { PART_PLACE, PART_RATE, PARTS } part; /* h and J; hdot and jdqd */

/* A link seen from an ancestor, in the ancestor's axes. */
typedef struct seen {
    bool known;
    kmp_vec axes[3], origin, v, a, w, wd;
    kmp_ref beta[3][3];
} seen;

/* The motion of a point from an ancestor. */
typedef struct motion {
    kmp_vec x, v, a;
} motion;

/* One of the two points. */
typedef struct side {
    int ancestor, link; /* the common ancestor of both points; the point's link */
    kmp_vec local;      /* from the link's origin */
    motion by[WAYS];
    kmp_vec *column; /* n: dx/dq, derived */
} side;

/* The rows of a closure with either side by one of the ways. */
typedef struct version {
    bool known[PARTS];
    kmp_ref *place; /* h, then J by rows */
    kmp_ref *rate;  /* hdot, then jdqd */
} version;

typedef struct gap {
    int closure, row, count; /* its rows */
    side side[2];
    bool moves[3]; /* components of d that depend on coordinates */
    kmp_vec d;
    way chosen[PARTS][2];
    version version[WAYS][WAYS];
} gap;

typedef struct gaps {
    kmp_equations *eq;
    unsigned sets;
    gap *list;
    int count;
    int view; /* ancestor that `seen` belongs to */
    seen *seen;
    kmp_vec *arm; /* from each link's origin to the point at hand, link axes */
    int *path;
    kmp_derivative *derivative; /* along one direction after the other */
    bool failed;
} gaps;

static int place_count(const gaps *s, const gap *p)
{
    return p->count * (s->eq->n + 1);
}

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

static motion move_inward(gaps *s, const side *p)
{
    const kmp_tree *tree = &s->eq->tree;
    kmp_graph *g = tree->graph;
    motion m = {p->local, kmp_vec_zero(), kmp_vec_zero()};
    for (int i = p->link; i != p->ancestor; i = tree->links[i].parent) {
        const kmp_link *link = &tree->links[i];
        s->arm[i] = m.x;
        if (link->rotation) {
            kmp_vec before = m.v;
            m.v = kmp_vec_add(g, m.v, turn_rate(g, link->qd, link->axis, m.x));
            m.a = kmp_vec_add(g, m.a, turn_rate(g, link->qd, link->axis, kmp_vec_add(g, before, m.v)));
        } else {
            m.x = kmp_vec_add(g, m.x, kmp_link_slide(tree, i));
            m.v = kmp_vec_add(g, m.v, kmp_vec_axis(link->qd, link->axis));
        }
        m.x = kmp_vec_add(g, kmp_link_to_parent(tree, i, m.x), link->p);
        m.v = kmp_link_to_parent(tree, i, m.v);
        m.a = kmp_link_to_parent(tree, i, m.a);
    }
    return m;
}

/* One row of J: what each joint's motion does to the point, along f of the ancestor's axes. */
static void row_inward(gaps *s, const side *p, kmp_vec f, kmp_ref *row)
{
    const kmp_tree *tree = &s->eq->tree;
    kmp_graph *g = tree->graph;
    int depth = 0;
    (void)move_inward(s, p); /* the arms */
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

static kmp_vec combine(kmp_graph *g, const kmp_vec axes[3], kmp_vec u)
{
    kmp_vec r = kmp_vec_scale(g, u.x[0], axes[0]);
    for (int k = 1; k < 3; k++)
        r = kmp_vec_add(g, r, kmp_vec_scale(g, u.x[k], axes[k]));
    return r;
}

static kmp_vec apply_beta(kmp_graph *g, const seen *h, kmp_vec u)
{
    kmp_vec r;
    for (int i = 0; i < 3; i++) {
        r.x[i] = kmp_mul(g, h->beta[i][0], u.x[0]);
        for (int j = 1; j < 3; j++)
            r.x[i] = kmp_add(g, r.x[i], kmp_mul(g, h->beta[i][j], u.x[j]));
    }
    return r;
}

static void set_beta(kmp_graph *g, seen *m)
{
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        kmp_ref wj = m->w.x[j], wk = m->w.x[k], ww = kmp_mul(g, m->w.x[i], wj);
        m->beta[i][i] = kmp_neg(kmp_add(g, kmp_mul(g, wj, wj), kmp_mul(g, wk, wk)));
        m->beta[i][j] = kmp_sub(g, ww, m->wd.x[k]);
        m->beta[j][i] = kmp_add(g, ww, m->wd.x[k]);
    }
}

/* The link's axes in the ancestor's from its parent's: the constant rotation, then the joint's. */
static void turn_axes(const kmp_tree *tree, int i, const seen *h, seen *m)
{
    kmp_graph *g = tree->graph;
    const kmp_link *link = &tree->links[i];
    int p = (link->axis + 1) % 3, q = (link->axis + 2) % 3;
    memcpy(m->axes, h->axes, sizeof m->axes);
    for (int k = 0; link->turned && k < 3; k++) {
        kmp_vec column;
        for (int j = 0; j < 3; j++)
            column.x[j] = kmp_link_axes(tree, i, j, k);
        m->axes[k] = combine(g, h->axes, column);
    }
    for (int n = 0; link->rotation && n < 3; n++)
        kmp_rotate(g, kmp_neg(link->q), &m->axes[p].x[n], &m->axes[q].x[n]);
}

static void see(gaps *s, int i)
{
    const kmp_tree *tree = &s->eq->tree;
    kmp_graph *g = tree->graph;
    const kmp_link *link = &tree->links[i];
    if (s->seen[i].known)
        return;
    see(s, link->parent);
    const seen *h = &s->seen[link->parent];
    seen *m = &s->seen[i];
    m->known = true;
    turn_axes(tree, i, h, m);
    kmp_vec axis = m->axes[link->axis], r = combine(g, h->axes, link->p), rate = kmp_vec_scale(g, link->qd, axis);
    if (!link->rotation)
        r = kmp_vec_add(g, r, kmp_vec_scale(g, link->q, axis));
    m->origin = kmp_vec_add(g, h->origin, r);
    m->v = kmp_vec_add(g, h->v, kmp_vec_cross(g, h->w, r));
    m->a = kmp_vec_add(g, h->a, apply_beta(g, h, r));
    m->w = h->w;
    m->wd = h->wd;
    memcpy(m->beta, h->beta, sizeof m->beta);
    if (link->rotation) {
        m->w = kmp_vec_add(g, m->w, rate);
        m->wd = kmp_vec_add(g, m->wd, kmp_vec_cross(g, h->w, rate));
        set_beta(g, m);
    } else {
        m->v = kmp_vec_add(g, m->v, rate);
        m->a = kmp_vec_add(g, m->a, kmp_vec_scale(g, kmp_const(g, 2), kmp_vec_cross(g, h->w, rate)));
    }
}

static motion move_outward(gaps *s, const side *p)
{
    kmp_graph *g = s->eq->graph;
    if (s->view != p->ancestor) {
        memset(s->seen, 0, (size_t)s->eq->tree.count * sizeof *s->seen);
        s->view = p->ancestor;
        s->seen[s->view].known = true;
        for (int k = 0; k < 3; k++)
            s->seen[s->view].axes[k] = kmp_vec_axis(KMP_ONE, k);
    }
    see(s, p->link);
    const seen *m = &s->seen[p->link];
    kmp_vec r = combine(g, m->axes, p->local);
    return (motion){kmp_vec_add(g, m->origin, r), kmp_vec_add(g, m->v, kmp_vec_cross(g, m->w, r)),
                    kmp_vec_add(g, m->a, apply_beta(g, m, r))};
}

static bool is_axis(kmp_vec f)
{
    int numbers = 0;
    for (int k = 0; k < 3; k++)
        numbers += f.x[k] == KMP_ZERO || (f.x[k] | 1) == (KMP_ONE | 1);
    return numbers == 3;
}

static bool same_vector(kmp_vec a, kmp_vec b)
{
    return a.x[0] == b.x[0] && a.x[1] == b.x[1] && a.x[2] == b.x[2];
}

/* Whether another joint on the way to the point turns about an axis through the same point. */
static bool is_concurrent(const gaps *s, const side *p, int k)
{
    for (int i = p->link; i != p->ancestor; i = s->eq->tree.links[i].parent)
        if (i != k && s->eq->tree.links[i].rotation && same_vector(s->seen[i].origin, s->seen[k].origin))
            return true;
    return false;
}

/* f.(e x (x - o)). The moment (x - o) x f is shared by joints whose axes meet; for others, unless f is an axis,
 * e.(x x f) - f.(e x o), where e x o is shared by all points. */
static void row_outward(gaps *s, const side *p, kmp_vec f, kmp_ref *row)
{
    const kmp_tree *tree = &s->eq->tree;
    kmp_graph *g = tree->graph;
    kmp_vec x = p->by[WAY_OUTWARD].x, moment = kmp_vec_cross(g, x, f);
    (void)move_outward(s, p); /* the links as this ancestor sees them */
    for (int k = p->link; k != p->ancestor; k = tree->links[k].parent) {
        const kmp_link *link = &tree->links[k];
        const seen *m = &s->seen[k];
        kmp_vec e = m->axes[link->axis];
        kmp_ref along;
        if (!link->rotation)
            along = kmp_vec_dot(g, f, e);
        else if (is_axis(f) || is_concurrent(s, p, k))
            along = kmp_vec_dot(g, e, kmp_vec_cross(g, kmp_vec_sub(g, x, m->origin), f));
        else
            along = kmp_sub(g, kmp_vec_dot(g, e, moment), kmp_vec_dot(g, f, kmp_vec_cross(g, e, m->origin)));
        row[k - 1] = link->reversed ? kmp_neg(along) : along;
    }
}

/* -- derived ----------------------------------------------------------------------------------------- */

static void row_derived(gaps *s, const side *p, kmp_vec f, kmp_ref *row)
{
    const kmp_tree *tree = &s->eq->tree;
    for (int k = p->link; k != p->ancestor; k = tree->links[k].parent)
        row[k - 1] = kmp_vec_dot(tree->graph, f, p->column[k - 1]);
}

/* NULL: no memory. */
static kmp_derivative *along(gaps *s, int count, const kmp_ref *leaf, const kmp_ref *direction)
{
    if (!s->derivative)
        s->derivative = kmp_derivative_new(s->eq->graph, count, leaf, direction);
    else if (!kmp_derivative_restart(s->derivative, count, leaf, direction))
        return NULL;
    return s->derivative;
}

/* dx/dq of all sides, and their rates, by differentiation. */
static bool derive_sides(gaps *s)
{
    kmp_equations *eq = s->eq;
    kmp_derivative *dt = kmp_time_derivative(&eq->tree);
    for (int i = 0; dt && i < 2 * s->count; i++) {
        motion *m = &s->list[i / 2].side[i % 2].by[WAY_DERIVED];
        for (int k = 0; k < 3; k++) {
            m->v.x[k] = kmp_derivative_of(dt, m->x.x[k]);
            m->a.x[k] = kmp_derivative_of(dt, m->v.x[k]);
        }
    }
    kmp_derivative_free(dt);
    for (int k = 1; dt && k < eq->tree.count; k++) {
        kmp_ref leaf = kmp_input(eq->graph, KMP_IN_Q, (uint32_t)k - 1), one = KMP_ONE;
        kmp_derivative *d = along(s, 1, &leaf, &one);
        for (int i = 0; d && i < 2 * s->count; i++) {
            side *p = &s->list[i / 2].side[i % 2];
            bool on_path = k > p->ancestor && kmp_tree_is_above(&eq->tree, k, p->link);
            for (int j = 0; on_path && j < 3; j++)
                p->column[k - 1].x[j] = kmp_derivative_of(d, p->by[WAY_DERIVED].x.x[j]);
        }
        if (!d)
            return false;
    }
    return dt;
}

/* -- rows -------------------------------------------------------------------------------------------- */

/* Components of d that move, as leaves without sign, with the values that stand for them. */
static int leaves_of(const gap *p, const kmp_vec *values, kmp_ref leaf[3], kmp_ref to[3])
{
    int count = 0;
    for (int k = 0; k < 3; k++)
        if (p->moves[k]) {
            leaf[count] = p->d.x[k] & ~(kmp_ref)1;
            to[count++] = kmp_is_negative(p->d.x[k]) ? kmp_neg(values->x[k]) : values->x[k];
        }
    return count;
}

/* dh/dd of each row. */
static bool gradients(gaps *s, const gap *p, const kmp_ref *h, kmp_vec *gradient)
{
    for (int r = 0; r < p->count; r++)
        gradient[r] = kmp_vec_zero();
    for (int k = 0; k < 3; k++) {
        kmp_ref leaf = p->d.x[k] & ~(kmp_ref)1, one = kmp_is_negative(p->d.x[k]) ? kmp_neg(KMP_ONE) : KMP_ONE;
        if (!p->moves[k])
            continue;
        kmp_derivative *d = along(s, 1, &leaf, &one);
        for (int r = 0; d && r < p->count; r++)
            gradient[r].x[k] = kmp_derivative_of(d, h[r]);
        if (!d)
            return false;
    }
    return true;
}

/* hdot and jdqd of rows h from the rates of d. */
static bool rates(gaps *s, const gap *p, const kmp_ref *h, kmp_vec v, kmp_vec a, kmp_ref *rate)
{
    kmp_graph *g = s->eq->graph;
    kmp_ref leaf[7], to[7];
    leaf[0] = kmp_input(g, KMP_IN_TIME, 0);
    to[0] = KMP_ONE;
    int first = 1 + leaves_of(p, &v, leaf + 1, to + 1), count = first;
    kmp_derivative *d = along(s, first, leaf, to);
    for (int r = 0; d && r < p->count; r++)
        rate[r] = kmp_derivative_of(d, h[r]);
    for (int k = 0; k < 3; k++)
        if (p->moves[k] && kmp_graph_node(g, kmp_id(v.x[k]))->op != KMP_OP_CONST) {
            leaf[count] = v.x[k] & ~(kmp_ref)1;
            to[count++] = kmp_is_negative(v.x[k]) ? kmp_neg(a.x[k]) : a.x[k];
        }
    kmp_derivative *again = d ? along(s, count, leaf, to) : NULL;
    for (int r = 0; again && r < p->count; r++)
        rate[p->count + r] = kmp_derivative_of(again, rate[r]);
    return again;
}

static void put_rows(gaps *s, const gap *p, const way by[2], const kmp_vec *gradient, kmp_ref *rows)
{
    void (*const row_of[WAYS])(gaps *, const side *, kmp_vec, kmp_ref *) = {row_derived, row_inward, row_outward};
    kmp_graph *g = s->eq->graph;
    for (int r = 0; r < p->count; r++)
        for (int k = 0; k < 2; k++) { /* d = second point - first */
            kmp_vec f = k == 1 ? gradient[r] : kmp_vec_sub(g, kmp_vec_zero(), gradient[r]);
            row_of[by[k]](s, &p->side[k], f, rows + r * s->eq->n);
        }
}

/* Both points by their ways: d, and h of it. */
static bool place_points(gaps *s, const gap *p, const way by[2], gap *placed, kmp_ref *h)
{
    kmp_graph *g = s->eq->graph;
    kmp_ref leaf[3], to[3];
    uint16_t through;
    *placed = *p;
    placed->d = kmp_vec_sub(g, p->side[1].by[by[1]].x, p->side[0].by[by[0]].x);
    int count = leaves_of(p, &placed->d, leaf, to);
    memcpy(h, s->eq->h + p->row, (size_t)p->count * sizeof *h);
    for (int k = 0; k < 3; k++)
        placed->moves[k] = p->moves[k] && kmp_graph_node(g, kmp_id(placed->d.x[k]))->op != KMP_OP_CONST;
    return kmp_substitute(g, count, leaf, to, p->count, h, &through);
}

static bool derive_part(gaps *s, const gap *p, part what, const way by[2], version *v)
{
    kmp_graph *g = s->eq->graph;
    kmp_ref h[KMP_KIND_MAX_ROWS];
    kmp_vec gradient[KMP_KIND_MAX_ROWS];
    gap placed;
    const motion *first = &p->side[0].by[by[0]], *second = &p->side[1].by[by[1]];
    if (!place_points(s, p, by, &placed, h))
        return false;
    if (what == PART_RATE) {
        v->rate = KMP_NEW(kmp_ref, 2 * p->count);
        return v->rate &&
               rates(s, &placed, h, kmp_vec_sub(g, second->v, first->v), kmp_vec_sub(g, second->a, first->a), v->rate);
    }
    v->place = KMP_NEW(kmp_ref, place_count(s, p));
    if (!v->place || !gradients(s, &placed, h, gradient))
        return false;
    memcpy(v->place, h, (size_t)p->count * sizeof *h);
    put_rows(s, p, by, gradient, v->place + p->count);
    return true;
}

/* The closure's rows with its sides by two ways, derived when first asked for; NULL: no memory. */
static const version *version_of(gaps *s, gap *p, part what, const way by[2])
{
    version *v = &p->version[by[0]][by[1]];
    if (!s->failed && !v->known[what]) {
        v->known[what] = true;
        s->failed = !derive_part(s, p, what, by, v) || kmp_graph_failed(s->eq->graph);
    }
    return s->failed ? NULL : v;
}

/* -- which closures ---------------------------------------------------------------------------------- */

/* Whether the rows reach coordinates through d alone, whose components are different nodes. */
static bool is_seen_through(gaps *s, const gap *p)
{
    kmp_ref leaf[3], to[3], rows[KMP_KIND_MAX_ROWS];
    uint16_t through;
    int count = leaves_of(p, &p->d, leaf, to);
    for (int k = 0; k < count; k++)
        for (int j = 0; j < k; j++)
            if (leaf[k] == leaf[j])
                return false;
    for (int k = 0; k < count; k++) /* as they are */
        to[k] = leaf[k];
    memcpy(rows, s->eq->h + p->row, (size_t)p->count * sizeof *rows);
    if (!kmp_substitute(s->eq->graph, count, leaf, to, p->count, rows, &through))
        s->failed = true;
    return count > 0 && !(through & (1u << KMP_IN_Q));
}

static void add_gap(gaps *s, int row, int count)
{
    kmp_equations *eq = s->eq;
    const kmp_closure *closure = &eq->model->closures[eq->rows[row].closure];
    gap p = {.closure = eq->rows[row].closure, .row = row, .count = count};
    int ancestor;
    if (closure->point[0] < 0 || closure->point[1] < 0)
        return;
    p.d = kmp_point_difference(&eq->tree, closure->point[0], closure->point[1], &ancestor);
    for (int k = 0; k < 3; k++)
        p.moves[k] = kmp_graph_node(eq->graph, kmp_id(p.d.x[k]))->depends & (1u << KMP_IN_Q);
    if (!is_seen_through(s, &p))
        return;
    for (int k = 0; k < 2; k++) {
        side *point = &p.side[k];
        *point = (side){.ancestor = ancestor,
                        .link = kmp_point_link(&eq->tree, closure->point[k]),
                        .local = kmp_point_local(&eq->tree, closure->point[k])};
        point->by[WAY_DERIVED].x = kmp_point_position(&eq->tree, closure->point[k], ancestor);
        point->by[WAY_INWARD] = move_inward(s, point);
        point->by[WAY_OUTWARD] = move_outward(s, point);
        point->column = KMP_NEW(kmp_vec, eq->n);
        s->failed = s->failed || !point->column;
    }
    s->list[s->count++] = p;
}

static void free_gap(gap *p)
{
    for (way a = WAY_DERIVED; a < WAYS; a++)
        for (way b = WAY_DERIVED; b < WAYS; b++) {
            kmp_free(p->version[a][b].place);
            kmp_free(p->version[a][b].rate);
        }
    kmp_free(p->side[0].column);
    kmp_free(p->side[1].column);
}

/* -- the choice -------------------------------------------------------------------------------------- */

static bool is_asked(const gaps *s, part what)
{
    const unsigned sets[PARTS] = {KMP_SET_CLOSURE | KMP_SET_RESIDUAL, KMP_SET_JDQD | KMP_SET_RESIDUAL};
    return s->sets & sets[what];
}

static void count_part(gaps *s, gap *p, part what, kmp_cost *cost, bool add)
{
    void (*count)(kmp_cost *, int, const kmp_ref *) = add ? kmp_cost_add : kmp_cost_remove;
    const version *v = is_asked(s, what) ? version_of(s, p, what, p->chosen[what]) : NULL;
    if (!v)
        return;
    if (what == PART_PLACE && s->sets & (KMP_SET_CLOSURE | KMP_SET_RESIDUAL))
        count(cost, place_count(s, p), v->place);
    if (what == PART_RATE && s->sets & KMP_SET_RESIDUAL)
        count(cost, p->count, v->rate);
    if (what == PART_RATE && s->sets & KMP_SET_JDQD)
        count(cost, p->count, v->rate + p->count);
}

static void set_way(gaps *s, gap *p, part what, kmp_cost *cost, const way by[2])
{
    count_part(s, p, what, cost, false);
    memcpy(p->chosen[what], by, sizeof p->chosen[what]);
    count_part(s, p, what, cost, true);
}

static void choose_all(gaps *s, kmp_cost *cost, way w)
{
    const way by[2] = {w, w};
    for (int i = 0; i < s->count; i++)
        for (part what = PART_PLACE; what < PARTS; what++)
            set_way(s, &s->list[i], what, cost, by);
}

/* Takes the cheapest way for either point of one part of one closure, the others as they are. */
static bool choose_one(gaps *s, gap *p, part what, kmp_cost *cost)
{
    way best[2];
    long least = cost->operations;
    bool better = false;
    memcpy(best, p->chosen[what], sizeof best);
    for (int k = 0; k < 2 * WAYS; k++) {
        way by[2] = {best[0], best[1]};
        by[k / WAYS] = (way)(k % WAYS);
        if (by[k / WAYS] == best[k / WAYS])
            continue;
        set_way(s, p, what, cost, by);
        if (cost->operations < least) {
            least = cost->operations;
            memcpy(best, by, sizeof best);
            better = true;
        }
    }
    set_way(s, p, what, cost, best);
    return better;
}

/* The best single way for all, then closure by closure while it helps, a few times at most. */
static bool choose(gaps *s)
{
    kmp_cost cost;
    if (!kmp_cost_init(&cost, s->eq->graph, KMP_COST_ADDITION))
        return false;
    for (int i = 0; i < s->count; i++)
        for (part what = PART_PLACE; what < PARTS; what++)
            count_part(s, &s->list[i], what, &cost, true);
    long least = cost.operations;
    way best = WAY_DERIVED;
    for (way w = WAY_INWARD; w < WAYS; w++) {
        choose_all(s, &cost, w);
        if (cost.operations < least) {
            least = cost.operations;
            best = w;
        }
    }
    choose_all(s, &cost, best);
    bool better = true;
    for (int pass = 0; better && pass < 3; pass++) {
        better = false;
        for (int i = 0; i < s->count; i++)
            for (part what = PART_PLACE; what < PARTS; what++)
                better = (is_asked(s, what) && choose_one(s, &s->list[i], what, &cost)) || better;
    }
    bool ok = !cost.failed && !s->failed;
    kmp_cost_free(&cost);
    return ok;
}

/* All rows as they are, those of gaps with both sides derived: eq->derived. */
static bool keep_derived(gaps *s)
{
    static const way by[2] = {WAY_DERIVED, WAY_DERIVED};
    kmp_equations *eq = s->eq;
    size_t m = (size_t)eq->m, n = (size_t)eq->n;
    kmp_ref *to = KMP_NEW(kmp_ref, m * (n + 3));
    eq->derived = to;
    if (!to)
        return false;
    memcpy(to, eq->h, m * sizeof *to);
    memcpy(to + m, eq->hdot, m * sizeof *to);
    memcpy(to + 2 * m, eq->jdqd, m * sizeof *to);
    memcpy(to + 3 * m, eq->jacobian, m * n * sizeof *to);
    for (int i = 0; i < s->count; i++) {
        gap *p = &s->list[i];
        const version *place = is_asked(s, PART_PLACE) ? version_of(s, p, PART_PLACE, by) : NULL;
        const version *rate = is_asked(s, PART_RATE) ? version_of(s, p, PART_RATE, by) : NULL;
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
    return !s->failed;
}

/* Both parts are derived from h as it was before either is put in its place. */
static bool take(gaps *s, gap *p)
{
    kmp_equations *eq = s->eq;
    size_t rows = (size_t)p->count * sizeof(kmp_ref);
    const version *v[PARTS] = {NULL, NULL};
    for (part what = PART_PLACE; what < PARTS; what++) {
        v[what] = is_asked(s, what) ? version_of(s, p, what, p->chosen[what]) : NULL;
        if (is_asked(s, what) && !v[what])
            return false;
    }
    if (v[PART_PLACE]) {
        memcpy(eq->h + p->row, v[PART_PLACE]->place, rows);
        memcpy(eq->jacobian + p->row * eq->n, v[PART_PLACE]->place + p->count, (size_t)eq->n * rows);
    }
    if (v[PART_RATE]) {
        memcpy(eq->hdot + p->row, v[PART_RATE]->rate, rows);
        memcpy(eq->jdqd + p->row, v[PART_RATE]->rate + p->count, rows);
    }
    return true;
}

/* -- all together ------------------------------------------------------------------------------------ */

static void collect(gaps *s)
{
    kmp_equations *eq = s->eq;
    for (int r = 0, count; r < eq->m; r += count) {
        for (count = 1; r + count < eq->m && eq->rows[r + count].closure == eq->rows[r].closure;)
            count++;
        add_gap(s, r, count);
    }
    s->failed = s->failed || kmp_graph_failed(eq->graph) || !derive_sides(s);
}

/* The ways as numbers: of h and J for either point, then of the rates. */
static uint8_t *ways_of(gaps *s, const gap *p)
{
    return s->eq->ways.way + 4 * p->closure;
}

static void recall(gaps *s)
{
    for (int i = 0; i < 4 * s->count; i++) {
        gap *p = &s->list[i / 4];
        p->chosen[i % 4 / 2][i % 2] = (way)ways_of(s, p)[i % 4];
    }
}

static void note(gaps *s)
{
    for (int i = 0; i < 4 * s->count; i++) {
        const gap *p = &s->list[i / 4];
        ways_of(s, p)[i % 4] = (uint8_t)p->chosen[i % 4 / 2][i % 2];
    }
}

bool kmp_gaps_shorten(kmp_equations *eq, unsigned sets, bool search)
{
    gaps s = {.eq = eq, .sets = sets, .view = -1};
    if (eq->model->closure_count > MOST_CLOSURES)
        return true;
    s.list = KMP_NEW(gap, eq->model->closure_count);
    s.seen = KMP_NEW(seen, eq->tree.count);
    s.arm = KMP_NEW(kmp_vec, eq->tree.count);
    s.path = KMP_NEW(int, eq->tree.count);
    bool ok = s.list && s.seen && s.arm && s.path;
    if (ok)
        collect(&s);
    ok = ok && !s.failed && !kmp_graph_failed(eq->graph);
    if (ok && search) {
        ok = s.count == 0 || (choose(&s) && keep_derived(&s));
        note(&s);
    }
    if (ok)
        recall(&s);
    for (int i = 0; i < s.count; i++) {
        ok = ok && take(&s, &s.list[i]);
        free_gap(&s.list[i]);
    }
    kmp_derivative_free(s.derivative);
    kmp_free(s.list);
    kmp_free(s.seen);
    kmp_free(s.arm);
    kmp_free(s.path);
    return ok;
}
