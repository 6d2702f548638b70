/* SPDX-License-Identifier: BSD-3-Clause */
/* The position of a body relative to its parent: from the parent's point over the frame along the chain of motions to
 * its own point, as in symbols in dynamics/kinematics/link_tree.c. */
#include "model/data/pose.h"
#include "constraints/tolerances.h"
#include "linalg/dense/three.h"
#include "model/data/model.h"
#include <math.h>
#include <stddef.h>
#include <string.h>

/* Moves along v, which is in the current axes. */
static void move(kmp_pose *pose, const double v[3], double factor)
{
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            pose->p[i] += factor * pose->r[i][k] * v[k];
}

static void move_to(kmp_pose *pose, const kmp_number at[3], double factor)
{
    double v[3] = {at[0].value, at[1].value, at[2].value};
    move(pose, v, factor);
}

/* Rodrigues: cos 1 + sin [e] + (1 - cos) e e'. */
static void rotate(kmp_pose *pose, const double e[3], double angle)
{
    double c = cos(angle), s = sin(angle), m[3][3];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            int k = 3 - i - j; /* the third when they differ */
            double cross = i == j ? 0 : (j - i + 3) % 3 == 1 ? -e[k] : e[k];
            m[i][j] = (i == j) * c + s * cross + (1 - c) * e[i] * e[j];
        }
    kmp_turn3(pose->r, &m[0][0], false);
}

/* -- flexible bodies --------------------------------------------------------------------------------- */

/* a q + q' A q / 2, component c of each. */
static double quadratic_value(const kmp_number *a, const kmp_number *more, int c, int n, const double *q)
{
    double sum = 0;
    for (int k = 0; k < n; k++) {
        double slope = a[n * c + k].value;
        for (int l = 0; l < n; l++)
            slope += more[((ptrdiff_t)n * c + k) * n + l].value * q[l] / 2;
        sum += slope * q[k];
    }
    return sum;
}

void kmp_pose_along_beam(const kmp_flexible *flexible, const kmp_station *station, const double *q, kmp_pose *pose)
{
    static const double axis[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const double *own = q + flexible->first;
    const int n = flexible->count;
    double place[3];
    for (int c = 0; c < 3; c++)
        place[c] = station->at[c].value + quadratic_value(station->shift, station->shift_more, c, n, own);
    move(pose, place, 1);
    for (int c = 2; c >= 0; c--)
        rotate(pose, axis[c], quadratic_value(station->turn, station->turn_more, c, n, own));
}

void kmp_pose_to_station(const kmp_flexible *flexible, const kmp_station *station, const double *q, kmp_pose *pose)
{
    if (flexible->turned)
        kmp_turn3(pose->r, &flexible->axes[0][0], false);
    kmp_pose_along_beam(flexible, station, q, pose);
    if (flexible->turned)
        kmp_turn3(pose->r, &flexible->axes[0][0], true);
}

/* To a point of a body, without its own axes. */
static void move_to_point(const kempe_model *model, const kmp_point *point, const double *q, kmp_pose *pose)
{
    if (point->station == 0) {
        move_to(pose, point->at, 1);
        return;
    }
    const kmp_flexible *flexible = &model->flexibles[model->bodies[point->body].flexible - 1];
    kmp_pose_to_station(flexible, &flexible->stations[point->station - 1], q, pose);
    move_to(pose, point->offset, 1);
}

/* From the place that carries a flexible body to its frame. */
static void leave_station(const kempe_model *model, const kmp_body *body, const double *q, kmp_pose *pose)
{
    const kmp_flexible *flexible = body->flexible > 0 ? &model->flexibles[body->flexible - 1] : NULL;
    kmp_pose own = {.r = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    if (!flexible || !flexible->moved)
        return;
    kmp_pose_to_station(flexible, &flexible->stations[0], q, &own);
    kmp_turn3(pose->r, &own.r[0][0], true);
    move(pose, own.p, -1);
}

/* -- chains ------------------------------------------------------------------------------------------ */

/* More than poses at the user's coordinates. */
typedef struct further {
    const kmp_pose_charts *charts;
    double (*axes)[3];
    double (*places)[3]; /* NULL: not wanted, nor axes of translations */
} further;

/* Turns by the chart that is before (0) or after (2) rotation k. */
static void turn_chart(const further *also, int k, int after, kmp_pose *pose)
{
    for (int c = 0; also && also->charts && c < also->charts->count; c++)
        if (also->charts->first[c] == k - after && also->charts->before[c] == (after == 0))
            kmp_turn3(pose->r, also->charts->chart + 9 * (ptrdiff_t)c, false);
}

static void keep_axis(const kmp_motion *motion, const kmp_pose *pose, bool all, double axis[3])
{
    for (int i = 0; i < 3; i++) {
        axis[i] = 0;
        for (int k = 0; (all || motion->rotation) && k < 3; k++)
            axis[i] += pose->r[i][k] * motion->axis[k];
    }
}

static void hang(const kempe_model *model, const kmp_body *body, const further *also, const double *q, kmp_pose *pose)
{
    if (body->at >= 0) {
        const kmp_point *at = &model->points[body->at];
        move_to_point(model, at, q, pose);
        if (at->turned)
            kmp_turn3(pose->r, &at->axes[0][0], false);
    }
    if (body->turned && !body->reversed)
        kmp_turn3(pose->r, &body->frame[0][0], false);
    for (int k = body->first_motion; k < body->first_motion + body->motion_count; k++) {
        const kmp_motion *motion = &model->motions[k];
        turn_chart(also, k, 0, pose);
        if (also)
            keep_axis(motion, pose, also->places, also->axes[k]);
        if (also && also->places)
            memcpy(also->places[k], pose->p, sizeof pose->p);
        if (motion->rotation)
            rotate(pose, motion->axis, q[k]);
        else
            move(pose, motion->axis, q[k]);
        turn_chart(also, k, 2, pose);
    }
    if (body->turned && body->reversed)
        kmp_turn3(pose->r, &body->frame[0][0], true);
    leave_station(model, body, q, pose);
    if (body->to < 0)
        return;
    const kmp_point *to = &model->points[body->to];
    if (to->turned)
        kmp_turn3(pose->r, &to->axes[0][0], true);
    move_to(pose, to->at, -1);
}

static void place_all(const kempe_model *model, const further *also, const double *q, kmp_pose *poses)
{
    poses[0] = (kmp_pose){.r = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    for (int b = 1; b < model->body_count; b++) {
        poses[b] = poses[model->bodies[b].parent];
        hang(model, &model->bodies[b], also, q, &poses[b]);
    }
}

void kmp_pose_all(const kempe_model *model, const double *q, kmp_pose *poses)
{
    place_all(model, NULL, q, poses);
}

void kmp_pose_of_charts(const kempe_model *model, const kmp_pose_charts *charts, const double *q, kmp_pose *poses,
                        double (*axes)[3])
{
    const further also = {charts, axes, NULL};
    place_all(model, &also, q, poses);
}

void kmp_pose_motions(const kempe_model *model, const double *q, kmp_pose *poses, double (*axes)[3],
                      double (*places)[3])
{
    const further also = {NULL, axes, places};
    place_all(model, &also, q, poses);
}

bool kmp_pose_at_zero(const kempe_model *model, kmp_arena *arena, kmp_pose_zero *at)
{
    const size_t n = (size_t)model->motion_count + 1;
    *at = (kmp_pose_zero){KMP_ARENA_NEW(arena, double, n), KMP_ARENA_NEW(arena, kmp_pose, model->body_count),
                          kmp_arena_alloc(arena, n, sizeof *at->axes), kmp_arena_alloc(arena, n, sizeof *at->places)};
    if (!at->q || !at->poses || !at->axes || !at->places)
        return false;
    kmp_pose_motions(model, at->q, at->poses, at->axes, at->places);
    return true;
}

bool kmp_is_parallel(const double a[3], const double b[3])
{
    double n[3];
    kmp_cross3(a, b, n);
    return kmp_dot3(n, n) <= KMP_SAME_AXIS * KMP_SAME_AXIS;
}

const char *kmp_joint_off_axis(const kempe_model *model, const kmp_pose_zero *at, int body, int up,
                               const double axis[3], bool flat)
{
    for (; body != up; body = model->bodies[body].parent) {
        const kmp_body *b = &model->bodies[body];
        for (int k = b->first_motion; k < b->first_motion + b->motion_count; k++)
            if (model->motions[k].rotation ? !kmp_is_parallel(at->axes[k], axis)
                                           : flat && fabs(kmp_dot3(at->axes[k], axis)) > KMP_SAME_AXIS)
                return b->joint;
    }
    return NULL;
}

void kmp_pose_of_point(const kempe_model *model, const kmp_pose *poses, const double *q, int point, kmp_pose *pose)
{
    const kmp_point *at = &model->points[point];
    *pose = poses[at->body];
    move_to_point(model, at, q, pose);
    if (at->turned)
        kmp_turn3(pose->r, &at->axes[0][0], false);
}

void kmp_pose_axis(const kempe_model *model, const kmp_pose_zero *at, int point, int axis, double w[3])
{
    kmp_pose pose;
    kmp_pose_of_point(model, at->poses, at->q, point, &pose);
    for (int i = 0; i < 3; i++)
        w[i] = pose.r[i][axis];
}

/* Computes the quaternion from its largest component, which is at least a half (Shepperd 1978). */
void kmp_pose_quaternion(const kmp_pose *pose, const double *near, double out[4])
{
    double r[3][3];
    double trace = pose->r[0][0] + pose->r[1][1] + pose->r[2][2], best = trace, product = 0, length = 0;
    int largest = 3;
    memcpy(r, pose->r, sizeof r);
    for (int k = 0; k < 3; k++)
        if (r[k][k] > best) {
            best = r[k][k];
            largest = k;
        }
    if (largest == 3) {
        out[0] = r[2][1] - r[1][2];
        out[1] = r[0][2] - r[2][0];
        out[2] = r[1][0] - r[0][1];
        out[3] = 1 + trace;
    } else {
        int i = largest, j = (i + 1) % 3, k = (i + 2) % 3;
        out[i] = 1 + r[i][i] - r[j][j] - r[k][k];
        out[j] = r[j][i] + r[i][j];
        out[k] = r[k][i] + r[i][k];
        out[3] = r[k][j] - r[j][k];
    }
    for (int k = 0; k < 4; k++) {
        length += out[k] * out[k];
        product += near ? near[k] * out[k] : 0;
    }
    bool flip = near ? product < 0 : out[3] < 0;
    length = flip ? -sqrt(length) : sqrt(length);
    for (int k = 0; k < 4; k++)
        out[k] /= length;
}
