/* SPDX-License-Identifier: BSD-3-Clause */
/* Positions of the bodies at given coordinates, as numbers: for pictures, and for the angle between two points. */
#pragma once

#include "model/model.h"

/** v_ground = p + r v_body */
typedef struct kmp_pose {
    double p[3], r[3][3];
} kmp_pose;

/** Poses of every body of the model, the ground's too, at the user's coordinates q (n). */
void kmp_pose_all(const kempe_model *model, const double *q, kmp_pose *poses);

/** The angle, rad, between the axes of two points. */
double kmp_pose_angle(const kempe_model *model, const kmp_pose *poses, int first, int second);

/** Unit quaternion x, y, z, w of the rotation; of the two that mean it, the one nearer to `near` (NULL: w >= 0). */
void kmp_pose_quaternion(const kmp_pose *pose, const double *near, double out[4]);
