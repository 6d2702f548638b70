/* SPDX-License-Identifier: BSD-3-Clause */
/* Axes of the model with all coordinates zero, and rotations between bodies about one of them. */
#include "model/data/angle_sum.h"
#include "linalg/dense/dot.h"
#include "model/data/model.h"
#include "model/data/pose.h"
#include <float.h>
#include <math.h>

/* Cosine of the angle between axes at right angles, up to rounding. */
#define RIGHT_ANGLE 1e-12

/* By which unit vectors that are products of few rotations may differ through rounding, per component. */
#define ROUNDING (16 * DBL_EPSILON)

typedef struct rotation {
    double x[3][3]; /* columns: axes, in ground axes */
} rotation;

static void apply(const rotation *r, const double v[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = kmp_dot3(r->x[i], v);
}

/* The base of a body's joint, and the body, with all coordinates zero. Bodies follow their parents. */
static rotation rest(const kempe_model *model, int b, bool base)
{
    static const rotation ground = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    kmp_body *body = &model->bodies[b];
    if (b == 0)
        return ground;
    rotation r = rest(model, body->parent, false);
    if (body->at >= 0 && model->points[body->at].turned)
        kmp_turn3(r.x, &model->points[body->at].axes[0][0], false);
    if (body->turned && !body->reversed)
        kmp_turn3(r.x, &body->frame[0][0], false);
    if (base)
        return r;
    if (body->turned && body->reversed)
        kmp_turn3(r.x, &body->frame[0][0], true);
    if (body->to >= 0 && model->points[body->to].turned)
        kmp_turn3(r.x, &model->points[body->to].axes[0][0], true);
    return r;
}

static void rest_axis(const kempe_model *model, const kmp_measure_argument *argument, double out[3])
{
    kmp_point *point = &model->points[argument->point];
    rotation r = rest(model, point->body, false);
    if (point->turned)
        kmp_turn3(r.x, &point->axes[0][0], false);
    const double unit[3] = {argument->axis == 0, argument->axis == 1, argument->axis == 2};
    apply(&r, argument->along ? argument->along : unit, out);
}

/* True if all stations of a flexible body stay in the plane across w, which is in the axes of its numbers. */
static bool stays_in_plane(const kmp_flexible *f, const double w[3])
{
    const ptrdiff_t n = f->count;
    for (int s = 0; s < f->station_count; s++)
        for (ptrdiff_t k = 0; k < n + n * n; k++) {
            double shift[3], turned[3], across[3];
            for (int i = 0; i < 3; i++) {
                const kmp_station *at = &f->stations[s];
                shift[i] = k < n ? at->shift[i * n + k].value : at->shift_more[i * n * n + k - n].value;
                turned[i] = k < n ? at->turn[i * n + k].value : at->turn_more[i * n * n + k - n].value;
            }
            kmp_cross3(turned, w, across);
            const double size = fabs(across[0]) + fabs(across[1]) + fabs(across[2]);
            if (fabs(kmp_dot(3, shift, w)) > ROUNDING || size > ROUNDING)
                return false;
        }
    return true;
}

/* True if a flexible body bends only in the plane across w. */
static bool is_plane(const kempe_model *model, int b, const double w[3])
{
    const rotation r = rest(model, b, false);
    double own[3];
    for (int i = 0; i < 3; i++)
        own[i] = r.x[0][i] * w[0] + r.x[1][i] * w[1] + r.x[2][i] * w[2];
    const kmp_flexible *f = &model->flexibles[model->bodies[b].flexible - 1];
    double across[3];
    kmp_flexible_from_body(f, own, across);
    return stays_in_plane(f, across);
}

/* Adds `sign` for each rotation between a body and its ancestor; false if a rotation is about another axis than w, or
 * a body is flexible. Without `factor` also where a translation is along w. */
static bool add_path(const kempe_model *model, int b, int ancestor, const double w[3], int sign, double *factor)
{
    for (;; b = model->bodies[b].parent) {
        const kmp_body *body = &model->bodies[b];
        if (body->flexible && (factor || !is_plane(model, b, w)))
            return false;
        if (b == ancestor)
            return true;
        rotation base = rest(model, b, true);
        for (int k = body->first_motion; k < body->first_motion + body->motion_count; k++) {
            double e[3];
            apply(&base, model->motions[k].axis, e);
            double along = kmp_dot(3, e, w);
            if (!model->motions[k].rotation && !factor && fabs(along) > ROUNDING)
                return false;
            if (!model->motions[k].rotation)
                continue;
            for (int i = 0; i < 3; i++)
                if (fabs(e[i] - copysign(1, along) * w[i]) > ROUNDING)
                    return false;
            if (factor)
                factor[k] += sign * copysign(1, along);
        }
    }
}

bool kmp_angle_sum(const kempe_model *model, const kmp_measure_argument axis[3], double *constant, double *factor)
{
    double e[3][3];
    int body[3], common = 0;
    for (int k = 0; k < 3; k++) {
        rest_axis(model, &axis[k], e[k]);
        body[k] = model->points[axis[k].point].body;
        common = k == 0 ? body[k] : kmp_model_common_body(model, common, body[k]);
    }
    /* The angle from u to v about w; sine and cosine that are zero but for rounding are zero. */
    double across[3];
    kmp_cross3(e[0], e[1], across);
    double s = kmp_dot(3, e[2], across), c = kmp_dot(3, e[0], e[1]) - kmp_dot(3, e[2], e[0]) * kmp_dot(3, e[2], e[1]);
    *constant = atan2(fabs(s) > ROUNDING ? s : 0, fabs(c) > ROUNDING ? c : 0);
    for (int k = 0; k < 3; k++)
        if (model->points[axis[k].point].station > 0)
            return false;
    return add_path(model, body[2], common, e[2], 0, factor) && add_path(model, body[0], common, e[2], -1, factor) &&
           add_path(model, body[1], common, e[2], 1, factor);
}

bool kmp_moves_across(const kempe_model *model, int point, const kmp_measure_argument *axis)
{
    double w[3];
    int first = model->points[point].body, second = model->points[axis->point].body;
    int common = kmp_model_common_body(model, first, second);
    rest_axis(model, axis, w);
    return add_path(model, first, common, w, 0, NULL) && add_path(model, second, common, w, 0, NULL);
}

bool kmp_stays_across(const kempe_model *model, const kmp_measure_argument *direction, const kmp_measure_argument *axis)
{
    double e[3], w[3];
    rest_axis(model, direction, e);
    rest_axis(model, axis, w);
    return kmp_moves_across(model, direction->point, axis) &&
           fabs(e[0] * w[0] + e[1] * w[1] + e[2] * w[2]) <= RIGHT_ANGLE;
}

/* -- surfaces that touch ----------------------------------------------------------------------------- */

/* The plane in which two surfaces move and touch, from the normal of a plane or the plane of a profile. */

int kmp_touch_plane(const kempe_model *model, const kmp_contact_pair *touch)
{
    const kmp_touch_side *side = touch->side;
    const bool bends =
        side[0].point >= 0 && (model->points[side[0].point].station > 0 || model->points[side[1].point].station > 0);
    if (bends && side[1].shape != KMP_TOUCH_PIECE) /* the slip has two directions */
        return -1;
    for (int k = 0; k < 3; k++) {
        int axis = (side[1].axis + k) % 3; /* the rotation of a cylinder first */
        const kmp_measure_argument normal = {.point = side[1].point, .axis = axis};
        /* The plane of motion has the normal of a plane, and the curve of a profile. */
        const bool across = side[1].shape == KMP_TOUCH_PLANE ? axis != side[1].axis
                            : side[1].shape == KMP_TOUCH_PROFILE || side[1].shape == KMP_TOUCH_CAM ? axis == 2
                                                                                                   : true;
        if (across && kmp_moves_across(model, side[0].point, &normal))
            return axis;
    }
    return -1;
}
