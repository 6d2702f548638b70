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

/* mjcf_defaults.c */

/** Reads the classes of the model. */
void kmp_mjcf_read_classes(kmp_mjcf *m);

/** The class of a name; NULL after a complaint. */
const kmp_mjcf_class *kmp_mjcf_class_of(kmp_mjcf *m, const kmp_element *e, const char *name);

/** An element with the defaults for a word, or for several with blanks around, of its own class or else of this one
 * (NULL: main). */
kmp_mjcf_item kmp_mjcf_take(kmp_mjcf *m, const kmp_element *e, const char *word, const kmp_mjcf_class *around);

/** An element without defaults. */
kmp_mjcf_item kmp_mjcf_plain(const kmp_element *e);

/** The text of an attribute; NULL: neither the element nor a default has it. */
const char *kmp_mjcf_text(const kmp_mjcf_item *item, const char *key);

/** Numbers of an attribute over those of the defaults, over `values`; the most that any of them gives, 0: none. */
int kmp_mjcf_numbers(kmp_mjcf *m, const kmp_mjcf_item *item, const char *key, int least, int most, double *values);
double kmp_mjcf_number(kmp_mjcf *m, const kmp_mjcf_item *item, const char *key, double absent);

/** True where an attribute is "true", false where it is "false"; anything else is a complaint. */
bool kmp_mjcf_flag(kmp_mjcf *m, const kmp_mjcf_item *item, const char *key, bool absent);

/** The frame of `pos` and of the orientation that is given. */
kmp_pose kmp_mjcf_pose(kmp_mjcf *m, const kmp_mjcf_item *item);

/** The rotation whose axis z has this direction, by the smallest angle. False: it has no length. */
bool kmp_mjcf_along(const double z[3], double r[3][3]);

/* mjcf_bodies.c */

/** Adds the bodies of all elements `worldbody`, with their joints, masses, shapes and sites. */
void kmp_mjcf_add_bodies(kmp_mjcf *m);

/** By a name in the file; NULL after a complaint. */
const kmp_mjcf_body *kmp_mjcf_body_of(kmp_mjcf *m, const kmp_element *from, const char *name);
const kmp_mjcf_joint *kmp_mjcf_joint_of(kmp_mjcf *m, const kmp_element *from, const char *name);

/** True if a name is taken; takes it. */
bool kmp_mjcf_is_taken(kmp_mjcf_names *names, kmp_arena *arena, const char *name);
void kmp_mjcf_take_name(kmp_mjcf_names *names, kmp_arena *arena, const char *name);

/** A name that no other part has: with `_` at its end while it is taken. */
const char *kmp_mjcf_new_name(kmp_mjcf *m, kmp_mjcf_names *taken, const char *name);

/* mjcf_geoms.c */

/** An element of a body, or of a frame inside, with what applies to it. */
typedef struct kmp_mjcf_part {
    const kmp_element *element;
    kmp_pose frame; /* around it, in the body */
    const kmp_mjcf_class *around;
    struct kmp_mjcf_part *next, *last; /* of the first one of a list: its last one */
} kmp_mjcf_part;

/** Between two places, `fromto`: the centre, the axis z, and half the length as the second size, of a box or ellipsoid
 * the third one. */
void kmp_mjcf_put_between(kmp_mjcf *m, const kmp_mjcf_item *item, int solid, kmp_pose *f, double size[3]);

/** Adds the shapes of geoms; `heavy`: they give the body its mass. */
void kmp_mjcf_add_geoms(kmp_mjcf *m, const kmp_mjcf_body *body, bool heavy, const kmp_mjcf_part *geoms);

/* mjcf_equality.c */

/** Adds the closures of all elements `equality`. */
void kmp_mjcf_add_equalities(kmp_mjcf *m);

/* mjcf_tendons.c */

/** A linear form of coordinates: one of them, or the length of a fixed tendon; and its value at the references. */
typedef struct kmp_mjcf_form {
    int count;
    const char **joint;
    double *factor, reference, rest; /* the latter: where the springs of joints are at rest */
    bool slides;                     /* it is a length */
} kmp_mjcf_form;

/** Adds to a form: a coordinate of Kempe; a joint of the file; the joints of the fixed tendon of a name. */
void kmp_mjcf_add_term(kmp_mjcf *m, kmp_mjcf_form *f, const char *joint, double factor);
void kmp_mjcf_add_joint(kmp_mjcf *m, kmp_mjcf_form *f, const kmp_element *from, const char *name, double factor);
void kmp_mjcf_add_tendon(kmp_mjcf *m, kmp_mjcf_form *f, const kmp_element *from, const char *name);

/** Prints a form, "1*q(a) + -0.5*q(b)"; `word`: q, or qd for its rate. */
void kmp_mjcf_put_form(kmp_text *text, const kmp_mjcf_form *f, const char *word);

/** Adds the springs, dampers and friction of tendons, and actuators as forces of inputs. */
void kmp_mjcf_add_tendons(kmp_mjcf *m);
void kmp_mjcf_add_actuators(kmp_mjcf *m);
