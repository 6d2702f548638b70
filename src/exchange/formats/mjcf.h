/* SPDX-License-Identifier: BSD-3-Clause */
/* A model in MJCF on its way into the document (docs/mjcf.md): classes of defaults, bodies, equalities, tendons,
 * actuators. */
#pragma once

#include "exchange/formats/foreign_parts.h"
#include "model/language/nearest.h"

/** A class of defaults: the elements `default` of its name, in the order of the file. */
typedef struct kmp_mjcf_class {
    const char *name;
    const struct kmp_mjcf_class *parent; /* NULL: it is the outermost one, main */
    struct kmp_mjcf_class *next;
    const kmp_element **from;
    int count;
} kmp_mjcf_class;

/** An element and the elements that give its attributes where it has none, the nearest one first. */
typedef struct kmp_mjcf_item {
    const kmp_element *own;
    const kmp_element **defaults;
    int count;
} kmp_mjcf_item;

typedef struct kmp_mjcf_body {
    const char *name, *own; /* in the file, NULL: none; in Kempe */
    kmp_pose world;         /* at the reference coordinates */
    kmp_yaml *map;
    bool fixed; /* to the world */
    struct kmp_mjcf_body *next;
} kmp_mjcf_body;

typedef struct kmp_mjcf_joint {
    const char *name, *own;
    bool single, slides; /* with one coordinate; which is a length */
    double reference;    /* the coordinate at which the bodies are as the file places them */
    double rest;         /* that of springs without a length of their own, of this joint and of tendons */
    struct kmp_mjcf_joint *next;
} kmp_mjcf_joint;

typedef struct kmp_mjcf_site {
    const char *name, *point; /* BODY.POINT */
    double world[3];          /* at the reference coordinates */
    struct kmp_mjcf_site *next;
} kmp_mjcf_site;

/** Names that are taken. */
typedef struct kmp_mjcf_names {
    const char **list;
    int count;
    kmp_name_index index;
} kmp_mjcf_names;

typedef struct kmp_mjcf {
    kmp_import *im;
    kmp_mjcf_class *classes; /* main is the first one */
    kmp_mjcf_body world, *bodies, *last_body;
    kmp_mjcf_joint *joints, *last_joint;
    kmp_mjcf_site *sites;
    kmp_mjcf_names body_names, joint_names;
    int body_count;
    double angle; /* rad: unit of angles */
    char order[4];
    enum { KMP_MJCF_NEVER, KMP_MJCF_ALWAYS, KMP_MJCF_WHERE_ABSENT } inertia_from_geoms;
    double groups[2];   /* of geoms with mass: the first and the last one */
    bool ranges_count;  /* without the attribute `limited` */
    const char *meshes; /* folder of mesh files, from that of the file; NULL: its own */
    bool has_equalities, has_springs, has_dampers, has_friction, has_gravity, has_limits, has_actuators, has_clamps;
} kmp_mjcf;

/* mjcf_geoms.c */

/** An element of a body, or of a frame inside, with what applies to it. */
typedef struct kmp_mjcf_part {
    const kmp_element *element;
    kmp_pose frame; /* around it, in the body */
    const kmp_mjcf_class *around;
    struct kmp_mjcf_part *next, *last; /* of the first one of a list: its last one */
} kmp_mjcf_part;

/* mjcf_tendons.c */

/** A linear form of coordinates: one of them, or the length of a fixed tendon; and its value at the references. */
typedef struct kmp_mjcf_form {
    int count;
    const char **joint;
    double *factor, reference, rest; /* the latter: where the springs of joints are at rest */
    bool slides;                     /* it is a length */
} kmp_mjcf_form;

/** A conversion of formats.def. Errors are in import->status. */
void kmp_mjcf_convert(kmp_import *import);
