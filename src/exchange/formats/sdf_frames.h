/* SPDX-License-Identifier: BSD-3-Clause */
/* Frames of SDFormat (docs/sdf.md): models, links, joints and frames are frames with names of their scope; each is
 * given in another one, and a link carries it. Included files have some, too. */
#pragma once

#include "exchange/formats/foreign_parts.h"

typedef enum kmp_sdf_kind { KMP_SDF_MODEL, KMP_SDF_LINK, KMP_SDF_JOINT, KMP_SDF_FRAME } kmp_sdf_kind;

enum {
    KMP_SDF_WORLD = -1,
    KMP_SDF_NONE = -2
}; /* instead of the number of a frame: the world; none, after a complaint */

typedef struct kmp_sdf_frame {
    kmp_sdf_kind kind;
    const kmp_element *element;
    const kmp_element *placed; /* the element with its pose: of an included model it is its `include` */
    const char *scoped;        /* its name with the names of its models, "arm::hand" */
    const char *name;          /* Kempe's name of it */
    int version;               /* of its file, 100 major + minor */
    int model;                 /* that it is in; KMP_SDF_WORLD: none */
    int first;                 /* of a model: its first link, or model inside; KMP_SDF_NONE: there is none */
    bool fixed;                /* of a model: static */
    int up, depth;             /* the frame in which its pose is given, and the number of frames to the world */
    kmp_pose pose;
    int end[2]; /* of a joint: its parent and its child */
} kmp_sdf_frame;

typedef struct kmp_sdf {
    kmp_import *im;
    kmp_sdf_frame *frames;
    int count;
    kmp_import_index by_name; /* scoped */
    int includes;             /* files included so far */
    size_t hidden; /* characters of scoped names that Kempe's names do not have: the frames of the only model */
} kmp_sdf;

/** Collects all frames of the file and of the files that it includes, and places them. */
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
