/* SPDX-License-Identifier: BSD-3-Clause */
/* Joints whose rotations may be counted from another orientation: three rotations about axes each perpendicular to the
 * next. No force, closure or expression uses their coordinates, so that the angles appear only in the results. */
#include "model/data/spherical.h"
#include "base/memory.h"
#include "model/data/model.h"
#include <math.h>

/* Cosine of the angle between perpendicular unit axes, up to the rounding of their components. */
#define ACROSS 1e-14

/* -- coordinates in use ------------------------------------------------------------------------------ */

/* Coordinates from `count` on belong to forces that a mechanism by itself does not have. */
static void mark_expression(const kmp_expr *e, bool *used, int count)
{
    if (!e)
        return;
    if ((e->kind == KMP_EXPR_Q || e->kind == KMP_EXPR_QD) && e->index < count)
        used[e->index] = true;
    mark_expression(e->a, used, count);
    mark_expression(e->b, used, count);
    mark_expression(e->c, used, count);
}

static void mark_force(const kmp_force *force, bool *used, int count)
{
    if (force->motion >= 0)
        used[force->motion] = true;
    mark_expression(force->effort, used, count);
    mark_expression(force->holding_effort, used, count);
    mark_expression(force->sliding, used, count);
    mark_expression(force->touch.gap, used, count);
    mark_expression(force->touch.way, used, count);
    mark_expression(force->touch.slip, used, count);
    if (force->kind == KMP_FORCE_TOUCH && force->touch.motion >= 0)
        used[force->touch.motion] = true;
    for (int k = 0; k < 3; k++)
        mark_expression(force->vector[k], used, count);
}

static void mark_used(const kempe_model *model, bool *used)
{
    const int count = model->motion_count;
    for (int c = 0; c < model->closure_count; c++) {
        const kmp_closure *closure = &model->closures[c];
        if (closure->motion >= 0)
            used[closure->motion] = true;
        for (int k = 0; k < closure->term_count; k++)
            used[closure->terms[k].motion] = true;
        mark_expression(closure->function, used, count);
        for (int k = 0; k < closure->curve_count; k++)
            mark_expression(closure->curve[k], used, count);
    }
    for (int b = 0; b < model->body_count; b++)
        if (model->bodies[b].coupling)
            used[model->bodies[b].first_motion + 1] = true; /* the closure has the first one */
    for (int k = 0; k < model->force_count; k++)
        mark_force(&model->forces[k], used, count);
    for (int k = 0; k < model->start.goal_count; k++)
        if (model->start.goals[k].motion >= 0)
            used[model->start.goals[k].motion] = true;
    for (int k = 0; k < model->state_count; k++)
        mark_expression(model->states[k].next ? model->states[k].next : model->states[k].delayed, used, count);
    for (int k = 0; k < model->sensor_count; k++)
        mark_expression(model->sensors[k].expr, used, count);
    for (int k = 0; k < model->run.until_count; k++)
        mark_expression(model->run.until[k], used, count);
    for (int k = 0; k < model->unknowns_count; k++) /* names, and variables that are solved for */
        for (int i = 0; i < KMP_UNKNOWNS_MOST && (i == 0 || i < model->unknowns[k].count); i++)
            mark_expression(model->unknowns[k].zero[i], used, count);
}

/* -- joints ------------------------------------------------------------------------------------------ */

static bool is_across(const kmp_motion *a, const kmp_motion *b)
{
    return fabs(a->axis[0] * b->axis[0] + a->axis[1] * b->axis[1] + a->axis[2] * b->axis[2]) <= ACROSS;
}

int kmp_spherical_find(const kempe_model *model, int *first)
{
    int count = 0, length;
    bool *used = KMP_NEW(bool, model->motion_count);
    if (!used)
        return -1;
    mark_used(model, used);
    for (int k = 0; k<model->motion_count; k += length> 0 ? length : 1) {
        const kmp_motion *m = &model->motions[k];
        int end = k; /* of the rotations of one body from motion k on */
        while (end < model->motion_count && model->motions[end].rotation && !model->motions[end].elastic &&
               model->motions[end].body == m->body)
            end++;
        length = end - k;
        if (length == 3 && is_across(&m[0], &m[1]) && is_across(&m[1], &m[2]) && !used[k] && !used[k + 1] &&
            !used[k + 2])
            first[count++] = k;
    }
    kmp_free(used);
    return count;
}
