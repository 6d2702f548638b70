/* SPDX-License-Identifier: BSD-3-Clause */
/* A file in SDFormat (docs/sdf.md): models, links, joints and frames are frames with names of their scope; each is
 * given in another one, and a link carries it. */
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
    const kmp_element *placed; /* the element with its pose: that of an included model is its `include` */
    const char *scoped;        /* its name with those of its models, "arm::hand" */
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
    size_t hidden;            /* characters of scoped names that Kempe's names do not have: those of the only model */
} kmp_sdf;
