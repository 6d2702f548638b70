/* SPDX-License-Identifier: BSD-3-Clause */
/* A model in MJCF on its way into the document (docs/mjcf.md), and attributes: an element has its own ones, and the
 * attributes of its class of defaults, which has the attributes of its parent. */
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
    double rest;         /* of springs without a length, of this joint and of tendons */
    struct kmp_mjcf_joint *next;
} kmp_mjcf_joint;

typedef struct kmp_mjcf_site {
    const char *name, *point; /* BODY.POINT */
    double world[3];          /* at the reference coordinates */
    struct kmp_mjcf_site *next;
} kmp_mjcf_site;

/** A geom with a name, around which a tendon may lie if it is a sphere or a cylinder. */
typedef struct kmp_mjcf_geom {
    const char *name, *body; /* in the file; the body in Kempe */
    const char *point;       /* BODY.POINT with its axes; NULL: no tendon has used it */
    bool ball, cylinder;
    double radius;
    kmp_pose frame, world; /* in the body; at the reference coordinates */
    struct kmp_mjcf_geom *next;
} kmp_mjcf_geom;

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
    kmp_mjcf_geom *geoms;
    kmp_mjcf_names body_names, joint_names;
    int body_count;
    double angle; /* rad: unit of angles */
    char order[4];
    enum { KMP_MJCF_NEVER, KMP_MJCF_ALWAYS, KMP_MJCF_WHERE_ABSENT } inertia_from_geoms;
    double groups[2];   /* of geoms with mass: the first and the last one */
    bool ranges_count;  /* without the attribute `limited` */
    const char *meshes; /* folder of mesh files, from the folder of the file; NULL: its own */
    bool has_equalities, has_springs, has_dampers, has_friction, has_gravity, has_limits, has_actuators, has_clamps;
} kmp_mjcf;

/** The class of a name; NULL after a complaint. */
const kmp_mjcf_class *kmp_mjcf_class_of(kmp_mjcf *m, const kmp_element *e, const char *name);

/** An element with the defaults for a word, or for several with blanks around, of the element's class or else of this
 * one (NULL: main). */
kmp_mjcf_item kmp_mjcf_take(kmp_mjcf *m, const kmp_element *e, const char *word, const kmp_mjcf_class *around);

/** An element without defaults. */
kmp_mjcf_item kmp_mjcf_plain(const kmp_element *e);

/** The text of an attribute; NULL: neither the element nor a default has it. */
const char *kmp_mjcf_text(const kmp_mjcf_item *item, const char *key);

/** Numbers of an attribute over the numbers of the defaults, over `values`; the most that any of them gives, 0: none.
 */
int kmp_mjcf_numbers(kmp_mjcf *m, const kmp_mjcf_item *item, const char *key, int least, int most, double *values);
double kmp_mjcf_number(kmp_mjcf *m, const kmp_mjcf_item *item, const char *key, double absent);

/** True where an attribute is "true", false where it is "false"; anything else is a complaint. */
bool kmp_mjcf_flag(kmp_mjcf *m, const kmp_mjcf_item *item, const char *key, bool absent);

/** The frame of `pos` and of the orientation that is given. */
kmp_pose kmp_mjcf_pose(kmp_mjcf *m, const kmp_mjcf_item *item);

/** The rotation whose axis z has this direction, by the smallest angle. False: it has no length. */
bool kmp_mjcf_along(const double z[3], double r[3][3]);
