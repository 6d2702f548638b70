/* SPDX-License-Identifier: BSD-3-Clause */
/* Bodies, closures and forces are united by all that they refer to (base/union_find.h). The same walk over the
 * references of an element unites them first, and gives them their new numbers in the copies afterwards. */
#include "model/data/islands.h"
#include "base/clones.h"
#include "base/context.h"
#include "base/memory.h"
#include "base/union_find.h"
#include "model/data/closure.h"
#include "model/data/force_table.h"
#include "model/data/gear.h"
#include "model/data/model.h"

/* A walk over references. While elements are united nothing is copied. */
typedef struct walk {
    const kempe_model *m;
    kmp_arena *arena;                     /* of copies; NULL: elements are united */
    int *up;                              /* of bodies, then closures, then forces */
    int self;                             /* the element whose references are walked */
    bool apart;                           /* nothing connects all parts */
    bool *out;                            /* of each element: it is left out */
    int *body, *motion, *closure, *force; /* new numbers */
    int *point, *owner;                   /* new number of a point, and the part that it was given in, from 1 */
    kempe_model *to;
    int part; /* from 1 */
} walk;

static void unite(walk *w, int other)
{
    w->up[kmp_root_of(w->up, other)] = kmp_root_of(w->up, w->self);
}

static int closure_node(const walk *w, int c)
{
    return w->m->body_count + c;
}

static int force_node(const walk *w, int f)
{
    return w->m->body_count + w->m->closure_count + f;
}

/* -- references ------------------------------------------------------------------------------------------ */

/* Bodies that do not move belong to all parts. */
static bool is_fixed(const kempe_model *m, int b)
{
    while (b > 0 && m->bodies[b].motion_count == 0)
        b = m->bodies[b].parent;
    return b == 0;
}

static int to_body(walk *w, int b)
{
    if (w->arena)
        return w->body[b];
    if (!is_fixed(w->m, b))
        unite(w, b);
    return b;
}

static int to_motion(walk *w, int k)
{
    if (k < 0)
        return k;
    (void)to_body(w, w->m->motions[k].body);
    return w->arena ? w->motion[k] : k;
}

/* A part has copies of the points that it refers to. */
static int to_point(walk *w, int p)
{
    if (p < 0)
        return p;
    const int body = to_body(w, w->m->points[p].body);
    if (!w->arena || w->owner[p] == w->part)
        return w->arena ? w->point[p] : p;
    if (!KMP_ARENA_GROW(w->arena, w->to->points, w->to->point_count))
        return 0;
    w->owner[p] = w->part;
    w->point[p] = w->to->point_count;
    w->to->points[w->to->point_count] = w->m->points[p];
    w->to->points[w->to->point_count].body = body;
    return w->to->point_count++;
}

static int to_closure(walk *w, int c)
{
    if (w->arena)
        return w->closure[c];
    w->apart = w->apart && !w->out[closure_node(w, c)];
    unite(w, closure_node(w, c));
    return c;
}

static int to_force(walk *w, int f)
{
    if (w->arena)
        return w->force[f];
    w->apart = w->apart && !w->out[force_node(w, f)];
    unite(w, force_node(w, f));
    return f;
}

static KMP_NOINLINE const kmp_measure *to_measure(walk *w, const kmp_measure *measure)
{
    kmp_measure own = *measure;
    for (int i = 0; i < own.count; i++) {
        w->apart = w->apart && own.argument[i].point >= 0; /* not of a contact, a closure or a joint */
        own.argument[i].point = to_point(w, own.argument[i].point);
    }
    return w->arena ? kmp_arena_copy(w->arena, &own, 1, sizeof own) : measure;
}

/* The index of an expression: of a coordinate or a closure. */
static KMP_NOINLINE int to_index(walk *w, const kmp_expr *expr)
{
    if (expr->kind == KMP_EXPR_Q || expr->kind == KMP_EXPR_QD)
        return to_motion(w, expr->index);
    if (expr->kind != KMP_EXPR_LAMBDA)
        return expr->index;
    for (int k = expr->number + 1; k < 0; k++) /* the size of several */
        (void)to_closure(w, expr->index - k);
    return to_closure(w, expr->index);
}

static const kmp_expr *to_expr(walk *w, const kmp_expr *expr)
{
    if (!expr)
        return NULL;
    const bool alone = expr->kind == KMP_EXPR_UNKNOWN || expr->kind == KMP_EXPR_CUT ||
                       (expr->kind == KMP_EXPR_LAMBDA && expr->measure);
    kmp_expr *own = w->arena ? kmp_arena_copy(w->arena, expr, 1, sizeof *expr) : NULL;
    w->apart = w->apart && !alone;
    if (alone)
        return expr;
    const int index = to_index(w, expr);
    const kmp_measure *measure = expr->kind == KMP_EXPR_MEASURE ? to_measure(w, expr->measure) : expr->measure;
    const kmp_expr *a = to_expr(w, expr->a), *b = to_expr(w, expr->b), *c = to_expr(w, expr->c);
    if (!own)
        return expr;
    own->index = index;
    own->measure = measure;
    own->a = a;
    own->b = b;
    own->c = c;
    return own;
}

/* -- elements -------------------------------------------------------------------------------------------- */

static void walk_body(walk *w, kmp_body *b)
{
    b->parent = to_body(w, b->parent);
    b->at = to_point(w, b->at);
    b->to = to_point(w, b->to);
    if (b->motion_count > 0)
        b->first_motion = to_motion(w, b->first_motion);
    if (b->load_count > 0)
        b->load_closure = to_closure(w, b->load_closure);
}

static void walk_gear(walk *w, kmp_closure *c)
{
    kmp_gear scratch, *gear = &scratch;
    if (!c->gear)
        return;
    if (w->arena)
        gear = kmp_arena_copy(w->arena, c->gear, 1, sizeof *c->gear);
    else
        scratch = *c->gear;
    if (!gear)
        return;
    gear->carrier = to_body(w, gear->carrier);
    for (int side = 0; side < 2; side++) {
        gear->wheel[side] = to_body(w, gear->wheel[side]);
        gear->centre[side] = to_point(w, gear->centre[side]);
        gear->axis[side] = to_motion(w, gear->axis[side]);
    }
    if (w->arena)
        c->gear = gear;
}

static void walk_closure(walk *w, kmp_closure *c)
{
    for (int k = 0; k < 2; k++) {
        c->point[k] = to_point(w, c->point[k]);
        c->curve[k] = to_expr(w, c->curve[k]);
    }
    c->motion = to_motion(w, c->motion);
    c->function = to_expr(w, c->function);
    if (c->term_count > 0 && w->arena)
        c->terms = kmp_arena_copy(w->arena, c->terms, c->term_count, sizeof *c->terms);
    for (int k = 0; c->terms && k < c->term_count; k++) {
        const int motion = to_motion(w, c->terms[k].motion);
        if (w->arena)
            c->terms[k].motion = motion;
    }
    walk_gear(w, c);
    if (c->kind == KMP_CLOSURE_friction || c->kind == KMP_CLOSURE_touch)
        c->force = to_force(w, c->force);
}

static void walk_force(walk *w, kmp_force *f)
{
    w->apart = w->apart && f->kind != KMP_FORCE_WHEEL && f->kind != KMP_FORCE_TYRE && f->kind != KMP_FORCE_COMPLIANT &&
               f->kind != KMP_FORCE_STATE;
    f->motion = to_motion(w, f->motion);
    f->effort = to_expr(w, f->effort);
    f->holding_effort = to_expr(w, f->holding_effort);
    f->sliding = to_expr(w, f->sliding);
    for (int k = 0; k < 3; k++)
        f->vector[k] = to_expr(w, f->vector[k]);
    const bool two_points = kmp_force_is_line(f->kind) || f->kind == KMP_FORCE_TORSION || f->kind == KMP_FORCE_BUSHING;
    for (int k = 0; k < 2; k++)
        if (two_points || (f->kind == KMP_FORCE_POINT && k == 0))
            f->point[k] = to_point(w, f->point[k]);
    if (f->kind == KMP_FORCE_BODY)
        f->body = to_body(w, f->body);
    if (f->kind == KMP_FORCE_TOUCH) {
        f->touch.gap = to_expr(w, f->touch.gap);
        f->touch.clearance = to_expr(w, f->touch.clearance);
        f->touch.way = to_expr(w, f->touch.way);
        f->touch.slip = to_expr(w, f->touch.slip);
        f->touch.motion = to_motion(w, f->touch.motion);
        for (int k = 0; k < 2; k++)
            f->touch.side[k].point = to_point(w, f->touch.side[k].point);
    }
    if (f->kind == KMP_FORCE_TOUCH || kmp_force_sticks(f))
        f->closure = to_closure(w, f->closure);
    if (f->kind == KMP_FORCE_FRICTION && f->contact > 0)
        f->contact = 1 + to_force(w, f->contact - 1);
    if (f->rubbing > 0)
        f->rubbing = 1 + to_force(w, f->rubbing - 1);
    if (f->through_count > 0 && w->arena) {
        int *through = kmp_arena_copy(w->arena, f->through, f->through_count, sizeof *through);
        for (int k = 0; through && k < f->through_count; k++)
            through[k] = to_point(w, through[k]);
        f->through = through;
    }
    for (int k = 0; k < f->through_count && !w->arena; k++)
        (void)to_point(w, f->through[k]);
}

/* -- groups ---------------------------------------------------------------------------------------------- */

/* Leaves contacts out, with their friction and their rows. Returns how many. */
static int leave_out(walk *w, const bool *contacts)
{
    const kempe_model *m = w->m;
    int count = 0;
    for (int f = 0; contacts && f < m->force_count; f++) {
        const kmp_force *force = &m->forces[f];
        const int contact = force->kind == KMP_FORCE_FRICTION && force->contact > 0 ? force->contact - 1 : f;
        w->out[force_node(w, f)] = contacts[contact] && m->forces[contact].kind == KMP_FORCE_TOUCH;
        count += w->out[force_node(w, f)];
    }
    for (int c = 0; count > 0 && c < m->closure_count; c++)
        if (m->closures[c].kind == KMP_CLOSURE_friction || m->closures[c].kind == KMP_CLOSURE_touch)
            w->out[closure_node(w, c)] = w->out[force_node(w, m->closures[c].force)];
    return count;
}

static void unite_all(walk *w)
{
    for (int b = 1; b < w->m->body_count; b++) {
        kmp_body body = w->m->bodies[b];
        w->self = b;
        if (!is_fixed(w->m, b))
            walk_body(w, &body);
    }
    for (int c = 0; c < w->m->closure_count; c++) {
        kmp_closure closure = w->m->closures[c];
        w->self = closure_node(w, c);
        if (!w->out[w->self])
            walk_closure(w, &closure);
    }
    for (int f = 0; f < w->m->force_count; f++) {
        kmp_force force = w->m->forces[f];
        w->self = force_node(w, f);
        if (!w->out[w->self])
            walk_force(w, &force);
    }
}

/* Numbers the groups: `part` of each element from 1, 0 of what does not move; elements that are left out have the
 * number after the last part. Returns the number of parts, 0 where the model is one and nothing is left out. */
static int number_parts(walk *w, bool all, int *part, bool *modes, int *number)
{
    const kempe_model *m = w->m;
    const int elements = force_node(w, m->force_count);
    int count = 0, rest = 0, with_modes = 0;
    for (int f = 0; f < m->force_count; f++)
        if (!w->out[force_node(w, f)])
            modes[kmp_root_of(w->up, force_node(w, f))] |= kmp_force_has_modes(&m->forces[f]);
    for (int b = 1; b < m->body_count; b++) {
        const int root = kmp_root_of(w->up, b);
        if (is_fixed(m, b) || number[root] > 0)
            continue;
        rest = rest == 0 && !modes[root] ? ++count : rest;
        number[root] = modes[root] ? ++count : rest;
        with_modes += modes[root];
    }
    for (int k = 1; k < elements; k++) {
        part[k] = w->out[k] ? count + 1 : k < m->body_count && is_fixed(m, k) ? 0 : number[kmp_root_of(w->up, k)];
        w->apart = w->apart && (part[k] > 0 || k < m->body_count); /* an element without a body that moves */
    }
    return w->apart && (!all || (with_modes > 0 && count > 1)) ? count : 0;
}

/* -- copies ---------------------------------------------------------------------------------------------- */

/* Numbers elements within their parts, and counts them there. Bodies that do not move come first in each part. */
static void number_elements(walk *w, const int *part, kmp_island *island, int count)
{
    const kempe_model *m = w->m;
    int fixed = 1;
    for (int b = 1; b < m->body_count; b++)
        w->body[b] = part[b] == 0 ? fixed++ : 0;
    for (int i = 0; i < count; i++)
        island[i].model->body_count = fixed;
    for (int b = 1; b < m->body_count; b++) {
        kempe_model *to = part[b] > 0 ? island[part[b] - 1].model : NULL;
        if (!to)
            continue;
        w->body[b] = to->body_count++;
        for (int k = 0; k < m->bodies[b].motion_count; k++)
            w->motion[m->bodies[b].first_motion + k] = to->motion_count++;
    }
    for (int c = 0; c < m->closure_count; c++)
        if (!w->out[closure_node(w, c)])
            w->closure[c] = island[part[closure_node(w, c)] - 1].model->closure_count++;
    for (int f = 0; f < m->force_count; f++)
        if (!w->out[force_node(w, f)])
            w->force[f] = island[part[force_node(w, f)] - 1].model->force_count++;
}

/* Room for the elements of a part. */
static bool make_room(kmp_island *island, kmp_arena *arena)
{
    kempe_model *to = island->model;
    return KMP_ARENA_MAKE(
        arena, KMP_ROOM(kmp_body, to->body_count, &to->bodies), KMP_ROOM(kmp_motion, to->motion_count, &to->motions),
        KMP_ROOM(kmp_closure, to->closure_count, &to->closures), KMP_ROOM(kmp_force, to->force_count, &to->forces),
        KMP_ROOM(kmp_number, to->motion_count, &to->start.q, &to->start.qd),
        KMP_ROOM(bool, to->motion_count, &to->start.q_given, &to->start.qd_given, &to->start.hold),
        KMP_ROOM(int, to->motion_count, &island->motion), KMP_ROOM(int, to->closure_count, &island->closure));
}

static void copy_motions(const walk *w, int b, kmp_island *island)
{
    const kempe_model *m = w->m;
    kempe_model *to = island->model;
    for (int k = m->bodies[b].first_motion; k < m->bodies[b].first_motion + m->bodies[b].motion_count; k++) {
        const int i = w->motion[k];
        to->motions[i] = m->motions[k];
        to->motions[i].body = w->body[b];
        to->start.q[i] = m->start.q[k];
        to->start.qd[i] = m->start.qd[k];
        to->start.q_given[i] = m->start.q_given[k];
        to->start.qd_given[i] = m->start.qd_given[k];
        to->start.hold[i] = m->start.hold[k];
        island->motion[i] = k;
    }
}

static void copy_element(walk *w, kmp_island *island, int e)
{
    const kempe_model *m = w->m;
    kempe_model *to = island->model;
    if (e < m->body_count) {
        to->bodies[w->body[e]] = m->bodies[e];
        walk_body(w, &to->bodies[w->body[e]]);
        copy_motions(w, e, island);
    } else if ((e -= m->body_count) < m->closure_count) {
        to->closures[w->closure[e]] = m->closures[e];
        walk_closure(w, &to->closures[w->closure[e]]);
        island->closure[w->closure[e]] = e;
    } else {
        e -= m->closure_count;
        to->forces[w->force[e]] = m->forces[e];
        walk_force(w, &to->forces[w->force[e]]);
    }
}

/* A part without elements, which shares all else with the whole. */
static kempe_model *begin_model(const kempe_model *m, kmp_arena *arena)
{
    kempe_model *to = kmp_arena_copy(arena, m, 1, sizeof *m);
    if (!to)
        return NULL;
    to->arena = (kmp_arena){0};
    to->source.has_digest = false;
    to->variant = NULL;
    to->points = NULL;
    to->shapes = NULL;
    to->outputs = NULL;
    to->sensors = NULL;
    to->bearings = NULL;
    to->cut_coordinates = NULL;
    to->cuts = NULL;
    to->point_count = to->shape_count = to->output_count = to->sensor_count = to->cut_count = 0;
    to->bearing_count = 0;
    to->body_count = to->motion_count = to->closure_count = to->force_count = to->cut_coordinate_count = 0;
    to->start.goals = NULL;
    to->start.goal_count = 0;
    to->run.independent = NULL;
    to->run.independent_count = 0;
    return to;
}

/* Makes the models of all parts. `order`: the elements by their parts, elements that do not move first; each part
 * begins at its `first`. */
static bool copy_parts(walk *w, const int *part, const int *order, const int *first, kmp_islands *all)
{
    for (int i = 0; i < all->count; i++)
        if (!(all->island[i].model = begin_model(w->m, w->arena)))
            return false;
    number_elements(w, part, all->island, all->count);
    for (int i = 0; i < all->count; i++) {
        kmp_island *island = &all->island[i];
        w->to = island->model;
        w->part = i + 1;
        if (!make_room(island, w->arena))
            return false;
        island->model->bodies[0] = w->m->bodies[0];
        for (int k = first[0]; k < first[1]; k++)
            copy_element(w, island, order[k]);
        for (int k = first[i + 1]; k < first[i + 2]; k++)
            copy_element(w, island, order[k]);
    }
    return !w->arena->failed;
}

/* -- all together ---------------------------------------------------------------------------------------- */

/* Sorts all elements but the ground by their parts. */
static void sort_elements(const int *part, int elements, int count, int *order, int *first)
{
    for (int k = 1; k < elements; k++)
        first[part[k] + 1]++;
    for (int i = 0; i <= count; i++)
        first[i + 1] += first[i];
    for (int k = elements; k-- > 1;) /* each part from its end */
        order[--first[part[k] + 1]] = k;
    for (int i = 0; i <= count; i++)
        first[i] = first[i + 1];
    first[count + 1] = elements - 1;
}

static kempe_status find(kmp_islands *all, const kempe_model *m, const bool *left_out, kmp_arena *scratch)
{
    const int elements = m->body_count + m->closure_count + m->force_count;
    const bool whole = m->state_count > 0 || m->delay_count > 0 || m->wheel_count > 0 || m->track_count > 0 ||
                       m->tyre_count > 0 || m->flexible_count > 0 ||
                       m->run.until_count > 0; /* something belongs to the whole */
    walk w = {.m = m, .apart = !whole};
    int *part, *number, *order, *first;
    bool *modes;
    bool any = false;
    for (int f = 0; f < m->force_count; f++)
        any = any || kmp_force_has_modes(&m->forces[f]);
    if (!w.apart || !any)
        return KEMPE_OK;
    KMP_TRY(kmp_made(
        m->context, KMP_ARENA_MAKE(scratch, KMP_ROOM(int, elements, &w.up, &part, &number, &order),
                                   KMP_ROOM(bool, elements, &modes, &w.out), KMP_ROOM(int, elements + 4, &first),
                                   KMP_ROOM(int, m->body_count, &w.body), KMP_ROOM(int, m->motion_count, &w.motion),
                                   KMP_ROOM(int, m->closure_count, &w.closure), KMP_ROOM(int, m->force_count, &w.force),
                                   KMP_ROOM(int, m->point_count, &w.point, &w.owner))));
    for (int k = 0; k < elements; k++)
        w.up[k] = k;
    const int out = leave_out(&w, left_out);
    unite_all(&w);
    all->count = number_parts(&w, out == 0, part, modes, number);
    if (all->count == 0)
        return KEMPE_OK;
    sort_elements(part, elements, all->count + (out > 0), order, first);
    w.arena = &all->arena;
    all->island = KMP_ARENA_NEW(&all->arena, kmp_island, all->count);
    return kmp_made(m->context, all->island && copy_parts(&w, part, order, first, all));
}

kempe_status kmp_islands_new(const kempe_model *model, const bool *left_out, kmp_islands **islands)
{
    KMP_MAKE(model->context, kmp_islands, all);
    kmp_arena scratch = {0};
    kempe_status status = find(all, model, left_out, &scratch);
    kmp_arena_free(&scratch);
    return KMP_GIVE_OR_FREE(status, islands, all, kmp_islands_free);
}

KMP_FREES(kmp_islands, islands, kmp_arena_free(&islands->arena))
