/* SPDX-License-Identifier: BSD-3-Clause */
/* Frames of foreign models, as numbers. */
#pragma once

#include "model/data/pose.h"

/** The rotation of columns r about the fixed axes x, y, z by these angles, rad, in this order: Rz Ry Rx. Entries of
 * multiples of a right angle are exact. */
void kmp_frame_rotate(const double rpy[3], double r[3][3]);

/** The rotation of a quaternion w, x, y, z, which need not have length one. False: it has no length. */
bool kmp_frame_turn(const double wxyz[4], double r[3][3]);

/** The rotation by an angle, rad, about an axis, which need not have length one. False: it has no length. */
bool kmp_frame_about(const double axis[3], double angle, double r[3][3]);

/** At the origin of the frame around it, with its axes. */
kmp_pose kmp_frame_none(void);

/** A frame that is given in another one, in the frame of that one. */
kmp_pose kmp_frame_in(const kmp_pose *outer, const kmp_pose *inner);

/** The frame around a frame, in that frame. */
kmp_pose kmp_frame_inverse(const kmp_pose *f);

/** A vector of the frame in the axes around it. */
void kmp_frame_vector(const kmp_pose *f, const double v[3], double out[3]);

/** True if the axes differ from those around the frame. */
bool kmp_frame_is_turned(const kmp_pose *f);
