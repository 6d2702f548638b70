/* SPDX-License-Identifier: BSD-3-Clause */
#include "dynamics/connected_bodies.h"
#include "model/data/body.h"
#include "model/data/closure.h"
#include "model/data/gear.h"
#include "model/data/model.h"
#include "model/data/rope.h"
#include "model/language/expression_value.h"

static void add_body(kmp_connected_bodies *to, int body)
{
    for (int k = 0; k < to->count; k++)
        if (to->body[k] == body)
            return;
    if (to->count == KMP_MOST_CONNECTED)
        to->any = true;
    else
        to->body[to->count++] = body;
}

void kmp_connected_by_point(kmp_connected_bodies *to, int point)
{
    if (point >= 0)
        add_body(to, to->model->points[point].body);
}

void kmp_connected_by_motion(kmp_connected_bodies *to, int motion)
{
    if (motion < 0)
        return;
    const int body = to->model->motions[motion].body;
    add_body(to, body);
    add_body(to, to->model->bodies[body].parent);
}

static void add_rope(kmp_connected_bodies *to, const kmp_rope *rope)
{
    for (int k = 0; k < rope->count; k++) {
        kmp_connected_by_point(to, rope->places[k].point);
        add_body(to, rope->places[k].carrier);
    }
}

static void add_gear(kmp_connected_bodies *to, const kmp_gear *gear)
{
    if (!gear) {
        to->any = true;
        return;
    }
    add_body(to, gear->wheel[0]);
    add_body(to, gear->wheel[1]);
    add_body(to, gear->carrier);
}

static void add_points(kmp_connected_bodies *to, const kmp_measure *measure)
{
    for (int k = 0; k < measure->count; k++) {
        const kmp_measure_argument *of = &measure->argument[k];
        to->any = to->any || of->point < 0;
        kmp_connected_by_point(to, of->point);
        if (of->frame > 0)
            add_body(to, of->frame - 1);
    }
    if (measure->count == 1) /* relative to the ground */
        add_body(to, 0);
}

static void add_measure(kmp_connected_bodies *to, const kmp_measure *measure)
{
    const int of = measure->argument[0].closure;
    switch (measure->kind) {
    case KMP_MEASURE_LENGTH:
    case KMP_MEASURE_FREE_LENGTH:
    case KMP_MEASURE_WRAP:
    case KMP_MEASURE_SLIDE:
        add_rope(to, &to->model->ropes[of]);
        break;
    case KMP_MEASURE_PATH:
    case KMP_MEASURE_TRANSMISSION_ERROR:
        add_gear(to, to->model->closures[of].gear);
        break;
    case KMP_MEASURE_POSITION:
    case KMP_MEASURE_VELOCITY:
    case KMP_MEASURE_ANGULAR_VELOCITY:
    case KMP_MEASURE_AXES:
    case KMP_MEASURE_DISTANCE:
    case KMP_MEASURE_ANGLE:
        add_points(to, measure);
        break;
    default:
        to->any = true;
    }
}

/* A test for kmp_expr_find that looks at every node. */
static bool look(const kmp_expr *expr, const void *user)
{
    kmp_connected_bodies *to = *(kmp_connected_bodies *const *)user;
    if (expr->kind == KMP_EXPR_MEASURE)
        add_measure(to, expr->measure);
    else if (expr->kind == KMP_EXPR_Q || expr->kind == KMP_EXPR_QD)
        kmp_connected_by_motion(to, expr->index);
    else if (expr->kind == KMP_EXPR_UNKNOWN || expr->kind == KMP_EXPR_CUT)
        to->any = true;
    return to->any;
}

void kmp_connected_by_expr(kmp_connected_bodies *to, const kmp_expr *expr)
{
    if (expr)
        (void)kmp_expr_find(expr, look, &to);
}

void kmp_connected_by_contact(kmp_connected_bodies *to, const kmp_force *contact)
{
    const kmp_contact_pair *touch = &contact->touch;
    kmp_connected_by_expr(to, touch->gap);
    kmp_connected_by_expr(to, touch->clearance);
    kmp_connected_by_expr(to, touch->way);
    kmp_connected_by_expr(to, touch->slip);
    for (int k = 0; k < 3; k++)
        kmp_connected_by_expr(to, contact->vector[k]);
    kmp_connected_by_motion(to, touch->motion);
    for (int k = 0; k < 2; k++)
        kmp_connected_by_point(to, touch->side[k].point);
    to->any = to->any || to->count == 0;
}
