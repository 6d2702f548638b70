/* SPDX-License-Identifier: BSD-3-Clause */
/* Variants of a point's position, its rates, and rows of J:
 *
 *   derived    d with runs of parallel axes merged, everything else by differentiation: best in the plane
 *   inward     from the point to the common ancestor, joint by joint: x, v = x', a = x'' at qdd = 0 in local axes,
 *              v' = R (v + qd e x x), a' = R (a + qd e x (v + v + qd e x x)); J = e.(r x f) with f, the gradient of the
 *              row by d, rotated outwards
 *   outward    from the ancestor in its axes: axes, origins, rates and beta = wd~ + w~ w~ of the links, shared by all
 *              points on them */
#include "dynamics/shorten/point_gap_inside.h"
#include "symbolic/derivative.h"
#include "symbolic/rotation.h"
#include <string.h>

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

/* The motion of the point, and the arm of each joint; without `rates` the position alone. */
static kmp_gap_motion move_inward(kmp_gaps *s, const kmp_gap_side *p, bool rates)
{
    const kmp_tree *tree = &s->eq->tree;
    kmp_graph *g = tree->graph;
    kmp_gap_motion m = {p->local, kmp_vec_zero(), kmp_vec_zero()};
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

kmp_gap_motion kmp_gap_move_inward(kmp_gaps *s, const kmp_gap_side *p)
{
    return move_inward(s, p, true);
}

void kmp_gap_row_inward(kmp_gaps *s, const kmp_gap_side *p, kmp_vec f, kmp_ref *row)
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

static kmp_vec combine(kmp_graph *g, const kmp_vec axes[3], kmp_vec u)
{
    kmp_vec r = kmp_vec_scale(g, u.x[0], axes[0]);
    for (int k = 1; k < 3; k++)
        r = kmp_vec_add(g, r, kmp_vec_scale(g, u.x[k], axes[k]));
    return r;
}

static void set_beta(kmp_graph *g, kmp_gap_seen *m)
{
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        kmp_ref wj = m->w.x[j], wk = m->w.x[k], ww = kmp_mul(g, m->w.x[i], wj);
        m->beta.x[i][i] = kmp_neg(kmp_add(g, kmp_mul(g, wj, wj), kmp_mul(g, wk, wk)));
        m->beta.x[i][j] = kmp_sub(g, ww, m->wd.x[k]);
        m->beta.x[j][i] = kmp_add(g, ww, m->wd.x[k]);
    }
}

static void see(kmp_gaps *s, int i)
{
    const kmp_tree *tree = &s->eq->tree;
    kmp_graph *g = tree->graph;
    const kmp_link *link = &tree->links[i];
    if (s->seen[i].known)
        return;
    see(s, link->parent);
    const kmp_gap_seen *h = &s->seen[link->parent];
    kmp_gap_seen *m = &s->seen[i];
    m->known = true;
    /* The link's axes in the ancestor's from its parent's: the constant rotation, then the joint's. */
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
    kmp_vec axis = m->axes[link->axis], r = combine(g, h->axes, link->p), rate = kmp_vec_scale(g, link->qd, axis);
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
        set_beta(g, m);
    } else {
        m->v = kmp_vec_add(g, m->v, rate);
        m->a = kmp_vec_add(g, m->a, kmp_vec_scale(g, kmp_const(g, 2), kmp_vec_cross(g, h->w, rate)));
    }
}

/* The links of the point relative to its ancestor. */
static void look_from_ancestor(kmp_gaps *s, const kmp_gap_side *p)
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

kmp_gap_motion kmp_gap_move_outward(kmp_gaps *s, const kmp_gap_side *p)
{
    kmp_graph *g = s->eq->graph;
    look_from_ancestor(s, p);
    const kmp_gap_seen *m = &s->seen[p->link];
    kmp_vec r = combine(g, m->axes, p->local);
    return (kmp_gap_motion){kmp_vec_add(g, m->origin, r), kmp_vec_add(g, m->v, kmp_vec_cross(g, m->w, r)),
                            kmp_vec_add(g, m->a, kmp_matrix_apply(g, &m->beta, false, r))};
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

/* True if another joint between ancestor and point turns about an axis through the same point. */
static bool is_concurrent(const kmp_gaps *s, const kmp_gap_side *p, int k)
{
    for (int i = p->link; i != p->ancestor; i = s->eq->tree.links[i].parent)
        if (i != k && s->eq->tree.links[i].rotation && same_vector(s->seen[i].origin, s->seen[k].origin))
            return true;
    return false;
}

/* f.(e x (x - o)). The moment (x - o) x f is shared by joints whose axes meet. For others, unless f is an axis, e.(x x
 * f) - f.(e x o), where e x o is shared by all points. */
void kmp_gap_row_outward(kmp_gaps *s, const kmp_gap_side *p, kmp_vec f, kmp_ref *row)
{
    const kmp_tree *tree = &s->eq->tree;
    kmp_graph *g = tree->graph;
    kmp_vec x = p->by[KMP_GAP_OUTWARD].x, moment = kmp_vec_cross(g, x, f);
    look_from_ancestor(s, p);
    for (int k = p->link; k != p->ancestor; k = tree->links[k].parent) {
        const kmp_link *link = &tree->links[k];
        const kmp_gap_seen *m = &s->seen[k];
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

void kmp_gap_row_derived(kmp_gaps *s, const kmp_gap_side *p, kmp_vec f, kmp_ref *row)
{
    const kmp_tree *tree = &s->eq->tree;
    for (int k = p->link; k != p->ancestor; k = tree->links[k].parent)
        row[k - 1] = kmp_vec_dot(tree->graph, f, p->column[k - 1]);
}

kmp_derivative *kmp_gap_along(kmp_gaps *s, int count, const kmp_ref *leaf, const kmp_ref *direction)
{
    if (!s->derivative)
        s->derivative = kmp_derivative_new(s->eq->graph, count, leaf, direction);
    else if (!kmp_derivative_restart(s->derivative, count, leaf, direction))
        return NULL;
    return s->derivative;
}

void kmp_gap_derive_sides(kmp_gaps *s)
{
    kmp_equations *eq = s->eq;
    kmp_derivative *dt = kmp_time_derivative(&eq->tree);
    for (int i = 0; i < 2 * s->count; i++) {
        kmp_gap_motion *m = &s->list[i / 2].side[i % 2].by[KMP_GAP_DERIVED];
        for (int k = 0; k < 3; k++) {
            m->v.x[k] = kmp_derivative_of(dt, m->x.x[k]);
            m->a.x[k] = kmp_derivative_of(dt, m->v.x[k]);
        }
    }
    kmp_derivative_free(dt);
    for (int k = 1; k < eq->tree.count; k++) {
        kmp_ref leaf = kmp_input(eq->graph, KMP_IN_Q, (uint32_t)k - 1), one = KMP_ONE;
        kmp_derivative *d = kmp_gap_along(s, 1, &leaf, &one);
        for (int i = 0; i < 2 * s->count; i++) {
            kmp_gap_side *p = &s->list[i / 2].side[i % 2];
            bool on_path = k > p->ancestor && kmp_tree_is_above(&eq->tree, k, p->link);
            for (int j = 0; on_path && j < 3; j++)
                p->column[k - 1].x[j] = kmp_derivative_of(d, p->by[KMP_GAP_DERIVED].x.x[j]);
        }
    }
}
