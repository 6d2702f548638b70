/* SPDX-License-Identifier: BSD-3-Clause */
/* Frames of SDFormat: names, the frame in which each is given, and included files. */
#pragma once

#include "exchange/formats/sdf_parts.h"

/** An element that says yes. */
bool kmp_sdf_yes(const kmp_element *e, const char *key);

/** Collects all frames of the file and of those that it includes, and places them. */
void kmp_sdf_find_frames(kmp_sdf *s);

/** The element whose models are read: the world, or the whole file. */
const kmp_element *kmp_sdf_world(const kmp_element *file);

/** The frame of a name in a model (or KMP_SDF_WORLD); KMP_SDF_NONE after a complaint at the element. */
int kmp_sdf_frame_named(kmp_sdf *s, int model, const char *name, const kmp_element *at);

/** The frame that the text of an inner element names. */
int kmp_sdf_frame_of(kmp_sdf *s, int model, const kmp_element *e, const char *key);

/** The pose of `to` in `from`. */
kmp_pose kmp_sdf_between(const kmp_sdf *s, int from, int to);

/** The link that carries a frame; KMP_SDF_WORLD; KMP_SDF_NONE after a complaint. */
int kmp_sdf_link_of(kmp_sdf *s, int frame);

/** True if the frame is in a static model. */
bool kmp_sdf_is_fixed(const kmp_sdf *s, int frame);

/** The name of the frame in which the pose of an element is given; NULL: the usual one. Before 1.7 it is `frame`. */
const char *kmp_sdf_relative(const kmp_element *e, int version);

/** The pose of the element `pose` inside, and nothing else. */
kmp_pose kmp_sdf_pose(kmp_import *im, const kmp_element *e);

/** A point BODY.NAME of the link that carries a frame, there. */
const char *kmp_sdf_point(kmp_sdf *s, const kmp_element *e, int frame, const char *name);
