/* SPDX-License-Identifier: BSD-3-Clause */
/* Links from bodies and motions; welded bodies are joined to the bodies that carry them. */
#include "dynamics/kinematics/link_tree.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "linalg/dense/rotations.h"
#include "model/data/force_table.h"
#include "model/data/model.h"
#include "model/data/spherical.h"
#include "symbolic/trig.h"
#include <float.h>
#include <math.h>
#include <string.h>

/* -- charts ------------------------------------------------------------------------------------------ */

/* Positions of the charts of spherical joints in the chain of links. */

/* True if a body moves with b: b itself, or welded to one that does. */
static bool moves_with(const kempe_model *model, int body, int b)
{
    while (body != b && body > 0 && model->bodies[body].motion_count == 0)
        body = model->bodies[body].parent;
    return body == b;
}

/* True if no rotation is between the ground and motion k. */
static bool is_upright(const kempe_model *model, int k)
{
    for (int b = model->motions[k].body; b > 0; b = model->bodies[b].parent)
        for (int i = model->bodies[b].first_motion; i < model->bodies[b].first_motion + model->bodies[b].motion_count;
             i++)
            if (i < k && model->motions[i].rotation)
                return false;
    return true;
}

/* The number of points that move with body b and whose positions closures and forces use. */
static int requested_points(const kempe_model *model, int b)
{
    int count = 0;
    for (int k = 0; k < 2; k++) {
        for (int c = 0; c < model->closure_count; c++) {
            int point = model->closures[c].point[k];
            count += point >= 0 && moves_with(model, model->points[point].body, b);
        }
        for (int f = 0; f < model->force_count; f++) {
            const kmp_force *force = &model->forces[f];
            bool requests = kmp_force_is_line(force->kind) || force->kind == KMP_FORCE_BUSHING ||
                            (force->kind == KMP_FORCE_POINT && k == 0);
            count += requests && moves_with(model, model->points[force->point[k]].body, b);
        }
    }
    return count;
}

bool kmp_tree_chart_before(const kempe_model *model, int first)
{
    enum { POINT = 80, TURNING_BASE = 150, OWN_DATA = 90, CARRIED = 70 }; /* operations added, about, as counted */
    int b = model->motions[first].body;
    if (first + 3 < model->bodies[b].first_motion + model->bodies[b].motion_count)
        return true; /* motions follow them */
    int before = POINT * requested_points(model, b) + (is_upright(model, first) ? 0 : TURNING_BASE);
    int count = 0;
    for (int c = b + 1; c < model->body_count; c++)
        count += model->bodies[c].motion_count > 0 && moves_with(model, model->bodies[c].parent, b);
    return before <= OWN_DATA + CARRIED * count;
}

/* Finds the charts of all motions, none unless the tree is charted. false: no memory. */
static bool tree_place_charts(kmp_tree *tree)
{
    const int n = tree->model->motion_count;
    int *first = KMP_ARENA_NEW(&tree->arena, int, n + 1), count = 0;
    if (first && tree->charted)
        count = kmp_spherical_find(tree->model, first);
    for (int k = 0; k < n; k++)
        tree->chart_before[k] = tree->chart_after[k] = -1;
    for (int c = 0; c < count; c++)
        if (kmp_tree_chart_before(tree->model, first[c]))
            tree->chart_before[first[c]] = c;
        else
            tree->chart_after[first[c] + 2] = c;
    return first && count >= 0;
}

/* -- constant rotations ------------------------------------------------------------------------------ */

static void identity(double m[3][3])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            m[i][j] = i == j;
}

static kmp_vec apply_chart(kmp_graph *g, int chart, bool transposed, kmp_vec v)
{
    kmp_matrix m;
    for (int k = 0; chart >= 0 && k < 9; k++)
        m.x[k / 3][k % 3] = kmp_input(g, KMP_IN_CHART, (uint32_t)(9 * chart + k));
    return chart >= 0 ? kmp_matrix_apply(g, &m, transposed, v) : v;
}

static kmp_vec apply(kmp_graph *g, double m[3][3], bool transposed, kmp_vec v)
{
    kmp_matrix numbers;
    for (int k = 0; k < 9; k++)
        numbers.x[k / 3][k % 3] = kmp_const(g, m[k / 3][k % 3]);
    return kmp_matrix_apply(g, &numbers, transposed, v);
}

/* Axes whose third is the unit vector e: Rodrigues' turn of z onto e about z x e. */
static void axes_along(const double e[3], double m[3][3])
{
    double c = e[2];
    if (c < 0) { /* turn -z instead, then half a turn about x: far from the singular case */
        double f[3] = {e[0], -e[1], -e[2]};
        axes_along(f, m);
        for (int j = 0; j < 3; j++) {
            m[1][j] = -m[1][j];
            m[2][j] = -m[2][j];
        }
        return;
    }
    double k = 1 / (1 + c);
    double r[3][3] = {{1 - k * e[0] * e[0], -k * e[0] * e[1], e[0]},
                      {-k * e[0] * e[1], 1 - k * e[1] * e[1], e[1]},
                      {-e[0], -e[1], c}};
    memcpy(m, r, sizeof r);
}

/* Chooses the link's axes in model axes: the model's own when the motion is about one of them. */
static void choose_axes(kmp_link *link, const double e[3])
{
    identity(link->a);
    for (int k = 0; k < 3; k++)
        if (fabs(e[k]) == 1) {
            link->axis = k;
            link->reversed = e[k] < 0;
            return;
        }
    link->axis = 2;
    axes_along(e, link->a);
}

/* A product of rotations that is one of axes onto axes but for rounding is made so exactly. */
static void round_axes(double m[3][3])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            if (fabs(m[i][j] - round(m[i][j])) < 4 * DBL_EPSILON)
                m[i][j] = round(m[i][j]) + 0.0;
}

static bool is_identity(double m[3][3])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            if (m[i][j] != (i == j))
                return false;
    return true;
}

/* The relative rotation including the charts of both: columns of a_parent' C_parent r C_link a_link. */
static void relate_chart(kmp_graph *g, kmp_link *link, kmp_link *parent, double r[3][3])
{
    if (link->before < 0 && parent->after < 0)
        return;
    for (int k = 0; k < 3; k++) {
        kmp_vec e = kmp_vec_zero();
        for (int i = 0; i < 3; i++)
            e.x[i] = kmp_const(g, link->a[i][k]);
        e = apply(g, r, false, apply_chart(g, link->before, false, e));
        e = apply(g, parent->a, true, apply_chart(g, parent->after, false, e));
        for (int i = 0; i < 3; i++)
            link->chart[i][k] = e.x[i];
    }
    link->turned = true;
}

/* v in axes that turn with the body's link, also where the link's own axes do not. */
static kmp_vec turning_vector(const kmp_tree *tree, int body, kmp_vec v)
{
    kmp_body_on_link *place = &tree->mounts[body];
    kmp_link *link = &tree->links[place->link];
    if (place->turned)
        v = apply(tree->graph, place->r, false, v);
    v = apply_chart(tree->graph, link->after, false, v);
    return link->axis == 2 && link->a[2][2] != 1 ? apply(tree->graph, link->a, true, v) : v;
}

kmp_vec kmp_body_vector(const kmp_tree *tree, int body, kmp_vec v)
{
    const kmp_link *link = &tree->links[tree->mounts[body].link];
    v = turning_vector(tree, body, v);
    kmp_link_turn(tree, link, link->lag, &v);
    return v;
}

/* The inverse of turning_vector. */
static kmp_vec own_vector(const kmp_tree *tree, int body, kmp_vec v)
{
    kmp_body_on_link *place = &tree->mounts[body];
    kmp_link *link = &tree->links[place->link];
    if (link->axis == 2 && link->a[2][2] != 1)
        v = apply(tree->graph, link->a, false, v);
    v = apply_chart(tree->graph, link->after, true, v);
    return place->turned ? apply(tree->graph, place->r, true, v) : v;
}

kmp_vec kmp_body_vector_back(const kmp_tree *tree, int body, kmp_vec v)
{
    const kmp_link *link = &tree->links[tree->mounts[body].link];
    kmp_link_turn(tree, link, kmp_neg(link->lag), &v);
    return own_vector(tree, body, v);
}

/* -- the tree ---------------------------------------------------------------------------------------- */

/* A body's tensor in link axes: b' I b with v_body = b v_link, by columns. */
static kmp_tensor body_inertia(const kmp_tree *tree, int body)
{
    static const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};
    const kmp_number *number = tree->model->bodies[body].inertia;
    kmp_body_on_link *place = &tree->mounts[body];
    const kmp_link *link = &tree->links[place->link];
    double b[3][3];
    kmp_tensor t, r;
    for (int k = 0; k < 6; k++)
        t.x[k] = kmp_tree_number(tree, &number[k]);
    kmp_product3(place->r, true, tree->links[place->link].a, b);
    bool charted = link->after >= 0;
    if (is_identity(b) && !charted)
        return t;
    for (int k = 0; charted && k < 6; k++) {
        kmp_vec ie = kmp_tensor_apply(tree->graph, t, own_vector(tree, body, kmp_vec_axis(KMP_ONE, column[k])));
        r.x[k] = turning_vector(tree, body, ie).x[row[k]];
    }
    for (int k = 0; !charted && k < 6; k++) {
        kmp_vec e = kmp_vec_zero();
        for (int j = 0; j < 3; j++)
            e.x[j] = kmp_const(tree->graph, b[j][column[k]]);
        kmp_vec ie = apply(tree->graph, b, true, kmp_tensor_apply(tree->graph, t, e));
        r.x[k] = ie.x[row[k]];
    }
    return r;
}

kmp_inertia kmp_body_inertia(const kmp_tree *tree, int b)
{
    const kmp_body *body = &tree->model->bodies[b];
    const kmp_link *link = &tree->links[tree->mounts[b].link];
    if (link->deformation)
        return (kmp_inertia){link->mass, link->com, link->inertia};
    kmp_vec com = kmp_body_vector(tree, b, kmp_tree_vector(tree, body->com));
    com = kmp_vec_add(tree->graph, com, tree->mounts[b].p);
    return (kmp_inertia){kmp_tree_number(tree, &body->mass), com, body_inertia(tree, b)};
}

/* The base of body b's joint: axes and origin with all its coordinates zero, on the parent's link. */
static kmp_body_on_link find_base(const kmp_tree *tree, int b)
{
    const kempe_model *model = tree->model;
    const kmp_body *body = &model->bodies[b];
    kmp_body_on_link base = tree->mounts[body->parent];
    double axes[3][3], frame[3][3];
    if (body->at >= 0) {
        base.link = kmp_point_link(tree, body->at);
        base.p = kmp_point_local(tree, body->at);
        memcpy(axes, model->points[body->at].axes, sizeof axes);
        if (model->points[body->at].turned)
            kmp_product3(base.r, false, axes, base.r);
    }
    memcpy(frame, body->frame, sizeof frame);
    if (body->turned && !body->reversed)
        kmp_product3(base.r, false, frame, base.r);
    round_axes(base.r);
    base.turned = !is_identity(base.r);
    return base;
}

/* The next link, whose parent, origin and axes are at `base`, which becomes the link's own; motion -1: it has none. */
static kmp_link *add_link(kmp_tree *tree, int motion, bool rotation, const double axis[3], kmp_body_on_link *base)
{
    kmp_link *link = &tree->links[tree->count];
    link->parent = base->link;
    link->body = -1;
    link->motion = motion;
    link->before = motion >= 0 ? tree->chart_before[motion] : -1;
    link->after = motion >= 0 ? tree->chart_after[motion] : -1;
    link->rotation = rotation;
    link->p = base->p;
    choose_axes(link, axis);
    /* g = a_parent' r a_link, where v_parent = r v_child in model axes at q = 0; `turned` unless it is the identity. */
    kmp_link *parent = &tree->links[link->parent];
    bool same = memcmp(link->a, parent->a, sizeof link->a) == 0;
    identity(link->g);
    if (!same || !is_identity(base->r)) {
        kmp_product3(parent->a, true, base->r, link->g);
        kmp_product3(link->g, false, link->a, link->g);
    }
    link->turned = !is_identity(link->g);
    relate_chart(tree->graph, link, &tree->links[link->parent], base->r);
    *base = (kmp_body_on_link){.link = tree->count++, .p = kmp_vec_zero()};
    identity(base->r);
    return link;
}

static void set_motion(kmp_tree *tree, int k, kmp_body_on_link *base)
{
    const kmp_motion *motion = &tree->model->motions[k];
    const kmp_body *body = &tree->model->bodies[motion->body];
    kmp_link *link = add_link(tree, k, motion->rotation, motion->axis, base);
    if (k == body->first_motion + body->motion_count - 1)
        link->body = motion->body;
    tree->of_motion[k] = base->link;
    link->q = kmp_input(tree->graph, KMP_IN_Q, (uint32_t)k);
    link->qd = kmp_input(tree->graph, KMP_IN_QD, (uint32_t)k);
    if (link->reversed) {
        link->q = kmp_neg(link->q);
        link->qd = kmp_neg(link->qd);
    }
}

/* r m' */
static void turn_back(double r[3][3], double m[3][3])
{
    double back[3][3];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            back[i][j] = m[j][i];
    kmp_product3(r, false, back, r);
    round_axes(r);
}

/* Attaches body b to the end of its chain by its own point: constants of the link, without motion. */
static void hang(kmp_tree *tree, int b, const kmp_body_on_link *end)
{
    const kempe_model *model = tree->model;
    kmp_body *body = &model->bodies[b];
    kmp_body_on_link *place = &tree->mounts[b];
    *place = *end;
    if (body->turned && body->reversed)
        turn_back(place->r, body->frame);
    if (body->to >= 0 && model->points[body->to].turned)
        turn_back(place->r, model->points[body->to].axes);
    place->turned = !is_identity(place->r);
    if (body->to < 0)
        return;
    kmp_vec at = kmp_body_vector(tree, b, kmp_tree_vector(tree, model->points[body->to].at));
    place->p = kmp_vec_sub(tree->graph, place->p, at);
}

/* -- flexible bodies --------------------------------------------------------------------------------- */

static const double unit_axes[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

/* A link that moves by a function of the body's coordinates; none where it is constantly zero. */
static void add_guided(kmp_tree *tree, const kmp_flexible *flexible, bool rotation, int axis, const kmp_station *at,
                       double sign, kmp_body_on_link *base)
{
    const int n = flexible->count;
    const kmp_number *linear = (rotation ? at->turn : at->shift) + (ptrdiff_t)axis * n;
    const kmp_number *more = (rotation ? at->turn_more : at->shift_more) + (ptrdiff_t)axis * n * n;
    kmp_guide *guide = KMP_GRAPH_NEW(tree->graph, kmp_guide, 1);
    kmp_ref value = KMP_ZERO, rate = KMP_ZERO;
    if (!guide || !kmp_guide_make(tree, flexible, linear, more, sign, guide, &value, &rate))
        return;
    kmp_link *link = add_link(tree, -1, rotation, unit_axes[axis], base);
    link->guide = guide;
    link->q = value;
    link->qd = rate;
}

/* The frame of a flexible body, on a separate link whose axes are the axes of its numbers: behind the station where its
 * joint is, if that moves; otherwise fixed to the end of the joint's chain. The link nearest to the ground that the
 * body's coordinates move. */
static int add_frame(kmp_tree *tree, int b, const kmp_flexible *flexible, kmp_body_on_link *base)
{
    const kmp_station *station = &flexible->stations[0];
    const int before = tree->count;
    for (int axis = 0; flexible->moved && axis < 3; axis++)
        add_guided(tree, flexible, true, axis, station, -1, base);
    for (int axis = 0; flexible->moved && axis < 3; axis++)
        add_guided(tree, flexible, false, axis, station, -1, base);
    const kmp_link *end = &tree->links[base->link];
    const bool own = base->link >= before || end->body == b; /* a link of only this body */
    if (!own || base->turned || end->after >= 0 || !is_identity(tree->links[base->link].a) || !kmp_vec_is_zero(base->p))
        add_link(tree, -1, false, unit_axes[0], base);
    tree->links[base->link].body = b;
    return base->link < before ? base->link : before;
}

/* The inertia of a flexible body, and its stations. */
static void set_flexible(kmp_tree *tree, int b, int innermost)
{
    const int which = tree->model->bodies[b].flexible - 1;
    const kmp_flexible *flexible = &tree->model->flexibles[which];
    kmp_link *frame = &tree->links[tree->mounts[b].link];
    frame->deformation = kmp_deformation_new(tree, flexible, innermost);
    if (!frame->deformation)
        return;
    const kmp_composite *whole = &frame->deformation->whole;
    frame->mass = whole->mass;
    frame->com = kmp_vec_scale(tree->graph, kmp_div(tree->graph, KMP_ONE, whole->mass), whole->moment);
    const kmp_tensor steiner = kmp_tensor_steiner(tree->graph, whole->mass, frame->com, frame->com);
    for (int k = 0; k < 6; k++)
        frame->inertia.x[k] = kmp_sub(tree->graph, whole->inertia.x[k], steiner.x[k]);
    for (int s = 0; s < flexible->station_count; s++) {
        const kmp_station *station = &flexible->stations[s];
        kmp_body_on_link base = {.link = tree->mounts[b].link, .p = kmp_tree_vector(tree, station->at)};
        identity(base.r);
        for (int axis = 0; axis < 3; axis++)
            add_guided(tree, flexible, false, axis, station, 1, &base);
        for (int axis = 3; axis-- > 0;)
            add_guided(tree, flexible, true, axis, station, 1, &base);
        if (base.link == tree->mounts[b].link) /* it does not move */
            add_link(tree, -1, false, unit_axes[0], &base);
        tree->stations[which][s] = base.link;
    }
}

/* -- bodies ------------------------------------------------------------------------------------------ */

static void set_body(kmp_tree *tree, int b)
{
    const kmp_body *body = &tree->model->bodies[b];
    kmp_body_on_link base = find_base(tree, b);
    for (int k = 0; k < body->motion_count; k++)
        set_motion(tree, body->first_motion + k, &base);
    if (kmp_body_has_armature(body))
        tree->links[tree->of_motion[body->first_motion]].armature = kmp_tree_number(tree, &body->armature);
    if (body->flexible) {
        if (body->turned && body->reversed)
            turn_back(base.r, tree->model->bodies[b].frame);
        kmp_flexible *flexible = &tree->model->flexibles[body->flexible - 1];
        if (flexible->turned)
            kmp_product3(base.r, false, flexible->axes, base.r);
        round_axes(base.r);
        base.turned = !is_identity(base.r);
        const int innermost = add_frame(tree, b, flexible, &base);
        if (flexible->turned)
            turn_back(base.r, flexible->axes);
        base.turned = !is_identity(base.r);
        tree->mounts[b] = base;
        set_flexible(tree, b, innermost);
        return;
    }
    hang(tree, b, &base);
    /* Adds a body to the link that carries it; the ground needs no mass. */
    kmp_link *link = &tree->links[tree->mounts[b].link];
    if (link == tree->links)
        return;
    kmp_inertia own = kmp_body_inertia(tree, b);
    if (link->body == b)
        link->com = own.com; /* where inputs act also when it has no mass */
    /* Two bodies as one: m = m1 + m2, c = (m1 c1 + m2 c2)/m, I = I1 + I2 + m1 m2/m (d.d 1 - d d') with d = c2 - c1
     * (Steiner). */
    kmp_graph *g = tree->graph;
    link->inertia = kmp_tensor_add(g, link->inertia, own.about_com);
    if (own.mass == KMP_ZERO)
        return;
    kmp_ref total = kmp_add(g, link->mass, own.mass), share = kmp_div(g, own.mass, total);
    kmp_vec d = kmp_vec_sub(g, own.com, link->com);
    if (link->mass == KMP_ZERO) {
        link->com = own.com;
    } else {
        link->com = kmp_vec_add(g, link->com, kmp_vec_scale(g, share, d));
        link->inertia = kmp_tensor_add(g, link->inertia, kmp_tensor_steiner(g, kmp_mul(g, share, link->mass), d, d));
    }
    link->mass = total;
}

/* A tree with room for its arrays. False: no memory. */
static bool allocate_tree(kmp_tree *tree, kmp_graph *g, const kempe_model *model, kmp_keep keep, bool charted)
{
    enum { GUIDED_MOST = 7 }; /* of a station, or of a frame */
    int most = model->motion_count + 1, variables = KMP_UNKNOWNS_MOST * model->unknowns_count;
    *tree = (kmp_tree){.graph = g, .model = model, .keep = keep, .charted = charted, .count = 1};
    for (int k = 0; k < model->flexible_count; k++)
        most += GUIDED_MOST * (1 + model->flexibles[k].station_count);
    KMP_ARENA_MAKE(&tree->arena, KMP_ROOM(kmp_link, most, &tree->links),
                   KMP_ROOM(kmp_body_on_link, model->body_count, &tree->mounts),
                   KMP_ROOM(double, model->motion_count + 1, &tree->factor),
                   KMP_ROOM(kmp_turn, model->motion_count + 1, &tree->turn),
                   KMP_ROOM(int, model->motion_count, &tree->of_motion, &tree->chart_before, &tree->chart_after),
                   KMP_ROOM(int *, model->flexible_count, &tree->stations), KMP_ROOM(kmp_time_seeds, 1, &tree->seeds),
                   KMP_ROOM(double, kmp_tree_symbol_count(tree), &tree->symbols),
                   KMP_ROOM(kmp_ref, variables, &tree->names.value, &tree->names.branch),
                   KMP_ROOM(kmp_name_state, model->unknowns_count, &tree->names.solved));
    for (int k = 0; tree->stations && k < model->flexible_count; k++)
        tree->stations[k] = KMP_ARENA_NEW(&tree->arena, int, model->flexibles[k].station_count);
    return !tree->arena.failed;
}

bool kmp_tree_init_again(kmp_tree *tree, const kmp_tree *from)
{
    if (!allocate_tree(tree, from->graph, from->model, from->keep, from->charted))
        return false;
    tree->count = from->count;
    memcpy(tree->links, from->links, (size_t)from->count * sizeof *from->links);
    memcpy(tree->of_motion, from->of_motion, (size_t)from->model->motion_count * sizeof *from->of_motion);
    for (int k = 0; k < from->model->flexible_count; k++)
        memcpy(tree->stations[k], from->stations[k],
               (size_t)from->model->flexibles[k].station_count * sizeof *from->stations[k]);
    memcpy(tree->mounts, from->mounts, (size_t)from->model->body_count * sizeof *from->mounts);
    memcpy(tree->symbols, from->symbols, (size_t)kmp_tree_symbol_count(from) * sizeof *from->symbols);
    tree->gravity = from->gravity;
    return true;
}

/* Angles from the ground, link by link: in a tree that may be so deep that a sum for each pair of links would cost the
 * square of their number. */
static void add_headings(kmp_tree *tree)
{
    enum { LONG = 64 };
    if (tree->count <= LONG || !(tree->heading = KMP_ARENA_NEW(&tree->arena, kmp_ref, tree->count)))
        return;
    for (int i = 1; i < tree->count; i++) {
        const kmp_link *link = &tree->links[i], *parent = &tree->links[link->parent];
        bool parallel = link->rotation && !link->turned && !link->guide &&
                        (link->parent == 0 || (parent->axis == link->axis && tree->heading[link->parent] != KMP_ZERO));
        if (parallel)
            tree->heading[i] = kmp_angle_add(tree->graph, tree->heading[link->parent], link->q);
    }
}

bool kmp_tree_init(kmp_tree *tree, kmp_graph *g, const kempe_model *model, kmp_keep keep, bool charted)
{
    if (!allocate_tree(tree, g, model, keep, charted) || !tree_place_charts(tree)) {
        kmp_tree_free(tree);
        return false;
    }
    tree->links[0].parent = tree->links[0].motion = tree->links[0].before = tree->links[0].after = -1;
    identity(tree->links[0].a);
    identity(tree->mounts[0].r);
    for (int b = 1; b < model->body_count; b++)
        set_body(tree, b);
    for (int k = kmp_model_coordinates(model); k < model->motion_count; k++) {
        /* The motion of a state: a rotation of a unit inertia on the ground. */
        kmp_body_on_link base = tree->mounts[0];
        set_motion(tree, k, &base);
        tree->links[base.link].inertia.x[0] = KMP_ONE;
    }
    tree->gravity = kmp_tree_vector(tree, model->gravity);
    add_headings(tree);
    return !kmp_graph_failed(g) && !tree->arena.failed;
}

static bool is_there(const kmp_tree *tree, kmp_ref r)
{
    return kmp_id(r) < kmp_graph_count(tree->graph);
}

void kmp_tree_forget(kmp_tree *tree)
{
    tree->seeds->count[0] = tree->seeds->count[1] = 0;
    for (int k = 0; k < KMP_UNKNOWNS_MOST * tree->model->unknowns_count; k++) {
        if (!is_there(tree, tree->names.value[k])) {
            tree->names.solved[k / KMP_UNKNOWNS_MOST] = KMP_NAME_UNKNOWN;
            tree->names.value[k] = KMP_ZERO;
        }
        if (!is_there(tree, tree->names.branch[k]))
            tree->names.branch[k] = KMP_ZERO;
    }
    for (int k = 0; k < tree->conditions.noted->count; k++)
        if (!is_there(tree, tree->conditions.noted->note[k].value))
            tree->conditions.noted->note[k].known = false;
}

void kmp_tree_sum_up(kmp_tree *tree)
{
    for (int i = 1; i < tree->count; i++) {
        kmp_link *link = &tree->links[i];
        link->about = link->deformation;
        link->own = link->deformation ? link->deformation->whole
                                      : kmp_composite_of(tree->graph, link->mass, link->com, link->inertia);
        link->base = link->own;
    }
}

static bool is_in(const char *list, const char *name)
{
    size_t length = strlen(name);
    for (const char *s = list; s && *s; s += strcspn(s, ","), s += *s == ',')
        if (strncmp(s, name, length) == 0 && (s[length] == ',' || s[length] == '\0'))
            return true;
    return false;
}

int kmp_tree_first_child(const kmp_tree *tree, int i)
{
    for (int k = i + 1; k < tree->count; k++)
        if (tree->links[k].parent == i)
            return k;
    return 0;
}

void kmp_tree_add_inputs(kmp_tree *tree, const char *without)
{
    for (int i = 1; i < tree->count; i++) {
        kmp_link *link = &tree->links[i];
        kmp_vec push, twist;
        if (link->body < 0 || is_in(without, tree->model->bodies[link->body].name))
            continue;
        for (int k = 0; k < 3; k++) {
            uint32_t number = (uint32_t)(3 * (link->body - 1) + k);
            push.x[k] = kmp_input(tree->graph, KMP_IN_FORCE, number);
            twist.x[k] = kmp_input(tree->graph, KMP_IN_TORQUE, number);
        }
        link->push = kmp_body_vector(tree, link->body, push);
        link->twist = kmp_body_vector(tree, link->body, twist);
    }
}

void kmp_tree_free(kmp_tree *tree)
{
    kmp_arena_free(&tree->arena);
}

int kmp_tree_time_leaf_count(const kmp_tree *tree)
{
    return 1 + (KMP_TIME_NUMBERS - 1) * tree->model->input_count;
}
