/* SPDX-License-Identifier: BSD-3-Clause */
/* The sides of a loop: on each body from its joint to the next, up to the common ancestor on both branches. A body that
 * slides can change its side, and excludes the test. */
#include "constraints/closing/loop_polygon.h"
#include "model/data/model.h"
#include <math.h>

static void position(const kempe_model *model, int point, double at[3])
{
    for (int k = 0; k < 3; k++)
        at[k] = point < 0 ? 0 : model->points[point].at[k].value;
}

static void add_side(kmp_loop_polygon *p, int body, int from, int to)
{
    double a[3], b[3];
    position(p->model, from, a);
    position(p->model, to, b);
    double length = hypot(hypot(b[0] - a[0], b[1] - a[1]), b[2] - a[2]);
    p->sum += length;
    if (length > p->longest) {
        p->longest = length;
        p->body = body;
        p->from = from;
        p->to = to;
    }
}

static bool turns_only(const kempe_model *model, int body)
{
    for (int k = 0; k < model->bodies[body].motion_count; k++)
        if (!model->motions[model->bodies[body].first_motion + k].rotation)
            return false;
    return true;
}

/* Adds the sides on the bodies from point `at` of `body` up to `top`. *at is then a point of `top`. */
static void climb(kmp_loop_polygon *p, int body, int top, int *at)
{
    for (; body != top; body = p->model->bodies[body].parent) {
        p->slides = p->slides || !turns_only(p->model, body);
        add_side(p, body, p->model->bodies[body].to, *at);
        *at = p->model->bodies[body].at;
    }
}

kmp_loop_polygon kmp_loop_polygon_of(const kempe_model *model, const kmp_closure *c)
{
    kmp_loop_polygon p = {.model = model, .from = -1, .to = -1};
    int at = c->point[0], bt = c->point[1];
    int a = model->points[at].body, b = model->points[bt].body, top = kmp_model_common_body(model, a, b);
    climb(&p, a, top, &at);
    climb(&p, b, top, &bt);
    add_side(&p, top, at, bt);
    return p;
}

double kmp_loop_longest_side(const kempe_model *model, int closure)
{
    const kmp_closure *c = &model->closures[closure];
    return c->point[0] >= 0 && c->point[1] >= 0 ? kmp_loop_polygon_of(model, c).longest : 0;
}
