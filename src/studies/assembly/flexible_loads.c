/* SPDX-License-Identifier: BSD-3-Clause */
/* Loads come from joints, closures and forces where independent coordinates have no accelerations. A load is taken
 * to the axis of the beam at its station, in the axes of the section there. */
#include "studies/assembly/flexible_loads.h"
#include "base/context.h"
#include "constraints/closing/assembly.h"
#include "constraints/closing/deformation_rows.h"
#include "constraints/closing/load_margin.h"
#include "constraints/tolerances.h"
#include "linalg/dense/three.h"
#include "model/data/closure.h"
#include "model/data/force.h"
#include "model/data/model.h"
#include "model/data/pose.h"
#include "model/language/expression_value.h"
#include "output/samples.h"
#include "studies/assembly/flexible_check.h"
#include <math.h>

typedef struct gathering {
    kmp_flexible_loads *to;
    const kempe_model *model;
    const double *q;
    kmp_pose *poses;
    double force, moment; /* the largest of all loads */
} gathering;

/* A load, in ground axes: a force, and a moment about a place. */
typedef struct applied {
    const char *kind, *name;
    double sign;
    const double *load;
    double place[3];
} applied;

static void place_of(const gathering *g, int body, int point, double place[3])
{
    kmp_pose pose = g->poses[body];
    if (point >= 0)
        kmp_pose_of_point(g->model, g->poses, g->q, point, &pose);
    for (int k = 0; k < 3; k++)
        place[k] = pose.p[k];
}

/* Keeps a load of body f at a station if it is in a direction without shapes. */
static void add_load(gathering *g, int which, int station, const applied *a)
{
    const kmp_flexible *f = &g->model->flexibles[which];
    const kmp_station *at = &f->stations[station];
    const bool fixed = at->at[0].value == 0 && f->frame == KMP_FRAME_CLAMPED;
    kmp_pose pose = g->poses[f->body];
    double arm[3], turned[3], load[2][3] = {{0}}, force[3], moment[3];
    kmp_unshaped_load made = {.flexible = which, .kind = a->kind, .name = a->name};
    if (fixed || f->file)
        return;
    kmp_pose_to_station(f, at, g->q, &pose);
    for (int k = 0; k < 3; k++)
        arm[k] = a->place[k] - pose.p[k];
    kmp_cross3(arm, a->load, turned);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) {
            load[0][i] += a->sign * pose.r[k][i] * a->load[k];
            load[1][i] += a->sign * pose.r[k][i] * (a->load[3 + k] + turned[k]);
        }
    kmp_flexible_from_body(f, load[0], force);
    kmp_flexible_from_body(f, load[1], moment);
    const double rest = KMP_LOAD_UNSHAPED * g->force,
                 about = KMP_LOAD_UNSHAPED * (g->moment + g->force * f->length->value);
    made.in[KMP_UNSHAPED_TORSION] = fabs(moment[0]) > about;
    made.in[KMP_UNSHAPED_Z] = fabs(force[2]) > rest || fabs(moment[1]) > about;
    made.in[KMP_UNSHAPED_Y] = fabs(force[1]) > rest || fabs(moment[2]) > about;
    bool any = false;
    for (int c = 0; c < KMP_UNSHAPED_DIRECTIONS; c++) {
        made.in[c] = made.in[c] && !kmp_flexible_bends(f, c);
        any = any || made.in[c];
    }
    kmp_unshaped_load *list = any ? kmp_arena_room(&g->to->arena, g->to->list, g->to->count, sizeof *list) : NULL;
    if (!list)
        return;
    g->to->list = list;
    list[g->to->count++] = made;
}

static int station_of(const kempe_model *model, int point)
{
    return point >= 0 && model->points[point].station > 0 ? model->points[point].station - 1 : 0;
}

static void add_closures(gathering *g, const double *loads)
{
    for (int c = 0; c < g->model->closure_count; c++)
        for (int side = 0; side < 2; side++) {
            const kmp_closure *closure = &g->model->closures[c];
            const int point = closure->point[0] >= 0 && closure->point[1] >= 0 ? closure->point[side] : -1;
            const int body = point >= 0 ? g->model->points[point].body : 0;
            if (g->model->bodies[body].flexible == 0)
                continue;
            applied a = {.kind = "loop", .name = closure->name, .sign = side == 1 ? 1 : -1};
            a.load = loads + (ptrdiff_t)KMP_LOAD_VALUES * c;
            place_of(g, 0, closure->point[1], a.place);
            add_load(g, g->model->bodies[body].flexible - 1, station_of(g->model, point), &a);
        }
}

static void add_joints(gathering *g, const kmp_all_loads *all, const double *loads)
{
    for (int k = 0; k < all->joints; k++) {
        const kmp_body *child = &g->model->bodies[all->joint[k]], *parent = &g->model->bodies[child->parent];
        applied a = {.kind = "joint", .name = child->joint, .load = loads + (ptrdiff_t)KMP_LOAD_VALUES * k};
        if (child->loads_parent)
            place_of(g, child->parent, child->at, a.place);
        else
            place_of(g, all->joint[k], child->to, a.place);
        a.sign = child->loads_parent ? 1 : -1;
        if (parent->flexible > 0)
            add_load(g, parent->flexible - 1, station_of(g->model, child->at), &a);
        a.sign = -a.sign;
        if (child->flexible > 0)
            add_load(g, child->flexible - 1, 0, &a);
    }
}

static void add_forces(gathering *g, const double *parameters)
{
    for (int k = 0; k < g->model->force_count; k++) {
        const kmp_force *f = &g->model->forces[k];
        double load[KMP_LOAD_VALUES] = {0};
        applied a = {.kind = "force", .name = f->name, .sign = 1, .load = load};
        const int body = f->kind == KMP_FORCE_POINT ? g->model->points[f->point[0]].body : 0;
        if (g->model->bodies[body].flexible == 0)
            continue;
        for (int i = 0; i < 3; i++) {
            load[i] = f->vector[i] ? kmp_expr_value_at(f->vector[i], parameters, 0) : 0;
            g->force = fmax(g->force, fabs(load[i]));
        }
        place_of(g, body, f->point[0], a.place);
        add_load(g, g->model->bodies[body].flexible - 1, station_of(g->model, f->point[0]), &a);
    }
}

static void gather(kmp_flexible_loads *to, kmp_deformation_rows *rows, double *qdd, double *lambda, kmp_pose *poses)
{
    const kempe_system *s = rows->s;
    gathering g = {.to = to, .model = s->model, .q = rows->q, .poses = poses};
    kmp_all_loads all = {0};
    if (!kmp_deformation_rows_at(rows, rows->q, rows->rest))
        return;
    kmp_deformation_rows_loads(rows, qdd, lambda);
    if (kmp_all_loads_init(&all, s) == KEMPE_OK) {
        const kmp_instant at = kmp_instant_of(rows->eval, 0, rows->q, rows->qd, qdd, lambda);
        const double *loads = kmp_all_loads_at(&all, &at);
        const int closures = s->model->closure_count;
        kmp_pose_all(s->model, rows->q, poses);
        for (int k = 0; k < KMP_LOAD_VALUES * (closures + all.joints); k++) {
            double *most = k % KMP_LOAD_VALUES < 3 ? &g.force : &g.moment;
            *most = fmax(*most, fabs(loads[k]));
        }
        add_closures(&g, loads);
        add_forces(&g, s->parameters);
        add_joints(&g, &all, loads + (ptrdiff_t)KMP_LOAD_VALUES * closures);
    } else {
        to->arena.failed = true;
    }
    kmp_all_loads_free(&all);
}

/* At a closed start of a system. */
static void find_at(kmp_flexible_loads *to, const kempe_system *s, const kempe_assembly *a)
{
    kmp_load_margin *margin;
    kmp_deformation_rows rows;
    double *qdd, *lambda;
    kmp_pose *poses;
    to->arena.failed = kmp_load_margin_new(s, a->q, a->qd, &margin) != KEMPE_OK || to->arena.failed;
    if (margin)
        kmp_load_margin_at(margin, 0, a->q, a->qd, NULL, to->taken);
    kmp_load_margin_free(margin);
    to->springs = kmp_load_margin_has_springs(s);
    to->creep = kmp_load_margin_has_creep(s);
    const kempe_status status = kmp_deformation_rows_of_shapes(&rows, s, a->q, a->qd);
    to->arena.failed = to->arena.failed || status == KEMPE_E_MEMORY;
    if (status != KEMPE_OK)
        return;
    if (KMP_ARENA_MAKE(&to->arena, KMP_ROOM(double, s->n, &qdd), KMP_ROOM(double, s->m, &lambda),
                       KMP_ROOM(kmp_pose, s->model->body_count, &poses)))
        gather(to, &rows, qdd, lambda, poses);
    kmp_deformation_rows_free(&rows);
}

bool kmp_flexible_loads_find(kmp_flexible_loads *to, const kempe_check *check)
{
    const kempe_system *s = check->own ? check->given : check->system;
    const kempe_assembly *a = check->assembly;
    kempe_assembly *own = NULL;
    *to = (kmp_flexible_loads){0};
    to->taken = KMP_ARENA_NEW(&to->arena, double, s->model->flexible_count);
    for (int k = 0; to->taken && k < s->model->flexible_count; k++)
        to->taken[k] = NAN;
    if (s->model->flexible_count == 0 || !to->taken)
        return to->taken;
    if (check->own) { /* the mechanism that is examined has no forces */
        const bool quiet = kmp_context_quiet(s->context, true);
        const kempe_status status = kmp_assembly_at_start(s, &own);
        (void)kmp_context_quiet(s->context, quiet);
        if (status == KEMPE_E_MEMORY)
            to->arena.failed = true;
        else if (status != KEMPE_OK)
            kmp_context_clear(s->context);
        a = own;
    }
    if (a && a->closed && !a->inner_q)
        find_at(to, s, a);
    kempe_assembly_free(own);
    return !to->arena.failed;
}

void kmp_flexible_loads_free(kmp_flexible_loads *to)
{
    kmp_arena_free(&to->arena);
}
