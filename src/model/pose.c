/* SPDX-License-Identifier: BSD-3-Clause */
/* The position of a body relative to its parent: from the parent's point over the frame along the chain of motions to
 * its own point, as in symbols in dynamics/kinematics/link_tree.c. */
#include "model/pose.h"
#include <math.h>
#include <string.h>

/* r m, or r m' when transposed; m row by row. */
static void turn(double r[3][3], const double *m, bool transposed)
{
    double product[3][3];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            product[i][j] = 0;
            for (int k = 0; k < 3; k++)
                product[i][j] += r[i][k] * (transposed ? m[3 * j + k] : m[3 * k + j]);
        }
    memcpy(r, product, sizeof product);
}

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
    turn(pose->r, &m[0][0], false);
}

static void hang(const kempe_model *model, const kmp_body *body, const double *q, kmp_pose *pose)
{
    if (body->at >= 0) {
        const kmp_point *at = &model->points[body->at];
        move_to(pose, at->at, 1);
        if (at->turned)
            turn(pose->r, &at->axes[0][0], false);
    }
    if (body->turned && !body->reversed)
        turn(pose->r, &body->frame[0][0], false);
    for (int k = body->first_motion; k < body->first_motion + body->motion_count; k++) {
        const kmp_motion *motion = &model->motions[k];
        if (motion->rotation)
            rotate(pose, motion->axis, q[k]);
        else
            move(pose, motion->axis, q[k]);
    }
    if (body->turned && body->reversed)
        turn(pose->r, &body->frame[0][0], true);
    if (body->to < 0)
        return;
    const kmp_point *to = &model->points[body->to];
    if (to->turned)
        turn(pose->r, &to->axes[0][0], true);
    move_to(pose, to->at, -1);
}

void kmp_pose_all(const kempe_model *model, const double *q, kmp_pose *poses)
{
    poses[0] = (kmp_pose){.r = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    for (int b = 1; b < model->body_count; b++) {
        poses[b] = poses[model->bodies[b].parent];
        hang(model, &model->bodies[b], q, &poses[b]);
    }
}

double kmp_pose_angle(const kempe_model *model, const kmp_pose *poses, int first, int second)
{
    const int point[2] = {first, second};
    double r[2][3][3], trace = 0;
    for (int k = 0; k < 2; k++) {
        const kmp_point *at = &model->points[point[k]];
        memcpy(r[k], poses[at->body].r, sizeof r[k]);
        if (at->turned)
            turn(r[k], &at->axes[0][0], false);
    }
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            trace += r[0][i][j] * r[1][i][j];
    return acos(fmax(-1, fmin(1, (trace - 1) / 2)));
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
