/* SPDX-License-Identifier: BSD-3-Clause */
/* Positions of the bodies at given coordinates, as numbers: for pictures, and for the angle between two points. */
#pragma once

#include "base/arena.h"
#include "model/data/flexible.h"
#include <kempe/kempe.h>
#include <stdbool.h>
#include <string.h>

/** r becomes r m, or r m' when transposed; m row by row. */
static inline void kmp_turn3(double r[3][3], const double *m, bool transposed)
{
    double product[3][3] = {{0}};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 3; k++)
                product[i][j] += r[i][k] * (transposed ? m[3 * j + k] : m[3 * k + j]);
    memcpy(r, product, sizeof product);
}

/** v_ground = p + r v_body */
typedef struct kmp_pose {
    double p[3], r[3][3];
} kmp_pose;

/** Charts of spherical joints: a constant rotation before the first or after the third of three rotations. */
typedef struct kmp_pose_charts {
    int count;
    const int *first;    /* count: the joint's first rotation */
    const bool *before;  /* count */
    const double *chart; /* nine numbers each, row by row */
} kmp_pose_charts;

/** Poses of every body of the model, the ground's too, at the user's coordinates q (n). */
void kmp_pose_all(const kempe_model *model, const double *q, kmp_pose *poses);

/** The same at coordinates in charts. axes (n): the axis of each rotation in the ground's axes; zero of a
 * translation. */
void kmp_pose_of_charts(const kempe_model *model, const kmp_pose_charts *charts, const double *q, kmp_pose *poses,
                        double (*axes)[3]);

/** Poses at the user's coordinates, with the axis of each motion (n) in the ground's axes and the place where its chain
 * is before it. */
void kmp_pose_motions(const kempe_model *model, const double *q, kmp_pose *poses, double (*axes)[3],
                      double (*places)[3]);

/** The same with all coordinates zero, in an arena. */
typedef struct kmp_pose_zero {
    const double *q;
    kmp_pose *poses;
    double (*axes)[3], (*places)[3];
} kmp_pose_zero;
bool kmp_pose_at_zero(const kempe_model *model, kmp_arena *arena, kmp_pose_zero *at);

/** An axis of a point in the ground's axes, with all coordinates zero. */
void kmp_pose_axis(const kempe_model *model, const kmp_pose_zero *at, int point, int axis, double w[3]);

/** True for unit vectors of one axis. */
bool kmp_is_parallel(const double a[3], const double b[3]);

/** The joint on the way from a body up to another one with a rotation about an axis that is not parallel to this one
 * or, where `flat`, with a translation along it. NULL: there is none. */
const char *kmp_joint_off_axis(const kempe_model *model, const kmp_pose_zero *at, int body, int up,
                               const double axis[3], bool flat);

/** A point with its axes, at the coordinates of the poses. */
void kmp_pose_of_point(const kempe_model *model, const kmp_pose *poses, const double *q, int point, kmp_pose *pose);

/** From the axes of a beam, at the body's origin, to the axes of its section at a station. */
void kmp_pose_along_beam(const kmp_flexible *flexible, const kmp_station *station, const double *q, kmp_pose *pose);

/** From the pose of a flexible body to the pose of a station of it: moved to its place, and turned as its section is.
 */
void kmp_pose_to_station(const kmp_flexible *flexible, const kmp_station *station, const double *q, kmp_pose *pose);

/** Unit quaternion x, y, z, w of the rotation; of the two that mean it, the one nearer to `near` (NULL: w >= 0). */
void kmp_pose_quaternion(const kmp_pose *pose, const double *near, double out[4]);
