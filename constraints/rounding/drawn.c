/* SPDX-License-Identifier: BSD-3-Clause */
#include "constraints/rounding/drawn.h"
#include "constraints/tolerances.h"
#include <float.h>
#include <math.h>
#include <string.h>

enum { MOST_DECIMALS = 12 };

/* -- the list ---------------------------------------------------------------------------------------- */

typedef struct listing {
    kempe_model *model;
    kmp_drawn *list;
    int count, most;
} listing;

static size_t axes_size(const kmp_drawn *n)
{
    return (n->frame ? 9 : 3) * sizeof *n->axes;
}

/* Adds a number; bodies and points that several loops share are listed once. */
static void add(listing *x, kmp_drawn n)
{
    for (int i = 0; i < x->count; i++)
        if (x->list[i].scalar == n.scalar && x->list[i].axes == n.axes && x->list[i].k == n.k)
            return;
    if (x->count == x->most)
        return;
    if (n.axes)
        memcpy(n.axes_drawn, n.axes, axes_size(&n));
    else
        n.scalar_drawn = *n.scalar;
    if (n.scalar && n.scalar->expr)
        n.sum = KMP_ARENA_NEW(&x->model->arena, kmp_expr, 2);
    x->list[x->count++] = n;
}

static void add_scalar(listing *x, kmp_number *scalar)
{
    if (scalar->value != 0)
        add(x, (kmp_drawn){.scalar = scalar});
}

static void add_axis(listing *x, double axis[3])
{
    for (int k = 0; k < 3; k++)
        if (axis[k] != 0 && fabs(axis[k]) != 1)
            add(x, (kmp_drawn){.axes = axis, .k = k});
}

static void add_frame(listing *x, bool turned, double frame[3][3])
{
    for (int k = 0; turned && k < 3; k++)
        add(x, (kmp_drawn){.axes = &frame[0][0], .frame = true, .k = k});
}

static void add_point(listing *x, int point)
{
    if (point < 0)
        return;
    kmp_point *p = &x->model->points[point];
    for (int k = 0; k < 3; k++)
        add_scalar(x, &p->at[k]);
    add_frame(x, p->turned, p->axes);
}

static void add_chain(listing *x, int body)
{
    for (; body != 0; body = x->model->bodies[body].parent) {
        kmp_body *b = &x->model->bodies[body];
        add_point(x, b->at);
        add_point(x, b->to);
        add_frame(x, b->turned, b->frame);
        for (int k = b->first_motion; k < b->first_motion + b->motion_count; k++)
            add_axis(x, x->model->motions[k].axis);
    }
}

int kmp_drawn_list(kempe_model *model, int most, kmp_drawn *list)
{
    listing x = {.model = model, .list = list, .most = most};
    for (int c = 0; c < model->closure_count; c++) {
        kmp_closure *closure = &model->closures[c];
        for (int k = 0; k < 2 && closure->point[0] >= 0 && closure->point[1] >= 0; k++) {
            add_point(&x, closure->point[k]);
            add_axis(&x, closure->axis[k]);
            add_chain(&x, model->points[closure->point[k]].body);
        }
        if (!closure->function)
            add_scalar(&x, &closure->number);
    }
    return model->arena.failed ? -1 : x.count;
}

/* -- rounding ---------------------------------------------------------------------------------------- */

/* Returns the number of decimals that a value is written with; -1: more than a drawing has. */
static int decimals_of(double value)
{
    double tens = 1;
    for (int d = 0; d <= MOST_DECIMALS; d++, tens *= 10)
        if (fabs(value * tens - round(value * tens)) <= 8 * DBL_EPSILON * fabs(value * tens))
            return d;
    return -1;
}

/* Finds the rounding of each number. Numbers with more decimals than a drawing has were computed, at least in single
 * precision. The others have the decimals of most of them, since trailing zeros are not written. Axes lost their digits
 * when they were normalised and take those of the lengths. */
double kmp_drawn_find_rounding(kmp_drawn *list, int count, double length)
{
    int with[MOST_DECIMALS + 1] = {0}, some = 0, most = 0;
    const double computed = FLT_EPSILON;
    for (int i = 0; i < count; i++) {
        int d = list[i].scalar ? decimals_of(list[i].scalar->value) : -1;
        some += d > 0;
        with[d > 0 ? d : 0] += d > 0;
    }
    for (int below = 0; most < MOST_DECIMALS && 2 * (below + with[most]) <= some; most++)
        below += with[most];
    double unit = some > 0 ? pow(10, -most) / length : computed;
    for (int i = 0; i < count; i++) {
        const kmp_number *p = list[i].scalar;
        list[i].rounding = p && decimals_of(p->value) < 0 ? fmin(unit, computed) : unit;
    }
    return unit;
}

/* -- shifts ------------------------------------------------------------------------------------------ */

static void put_back(kmp_drawn *n)
{
    if (n->scalar)
        *n->scalar = n->scalar_drawn;
    else
        memcpy(n->axes, n->axes_drawn, axes_size(n));
}

/* Shifts a scalar. If it has an expression, it is computed from that expression plus the shift when parameters vary. */
static void move_scalar(kmp_drawn *n, double by)
{
    n->scalar->value += by;
    if (!n->sum)
        return;
    n->sum[0] = (kmp_expr){.kind = KMP_EXPR_NUMBER, .value = by};
    n->sum[1] = (kmp_expr){.kind = KMP_EXPR_ADD, .a = n->scalar_drawn.expr, .b = &n->sum[0]};
    n->scalar->expr = &n->sum[1];
}

/* Turns a frame about its own axis k. */
static void turn(double *r, int k, double by)
{
    int i = (k + 1) % 3, j = (k + 2) % 3;
    double c = cos(by), s = sin(by);
    for (int row = 0; row < 3; row++) {
        double a = r[3 * row + i], b = r[3 * row + j];
        r[3 * row + i] = c * a + s * b;
        r[3 * row + j] = c * b - s * a;
    }
}

static void move_axes(const kmp_drawn *n, double by)
{
    double *a = n->axes;
    if (n->frame) {
        turn(a, n->k, by);
        return;
    }
    a[n->k] += by;
    double size = hypot(hypot(a[0], a[1]), a[2]);
    for (int k = 0; k < 3; k++)
        a[k] /= size;
}

void kmp_drawn_place(kmp_drawn *list, int count, const double *shift, double length)
{
    for (int i = 0; i < count; i++)
        put_back(&list[i]);
    for (int i = 0; shift && i < count; i++)
        if (fabs(shift[i]) > KMP_MEND_NO_SHIFT && list[i].scalar)
            move_scalar(&list[i], shift[i] * length);
        else if (fabs(shift[i]) > KMP_MEND_NO_SHIFT)
            move_axes(&list[i], shift[i]);
}
