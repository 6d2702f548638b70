/* SPDX-License-Identifier: BSD-3-Clause */
/* A model as the links and joints of a robot, for the writers of foreign formats: each joint has one motion at most, so
 * that further links without mass are between the motions of a chain. A link has the frame in which its joint ends.
 */
#pragma once

#include "base/text.h"
#include "exchange/formats/foreign_parts.h"
#include "model/data/closure.h"
#include "model/data/shape.h"

typedef enum kmp_writer_joint {
    KMP_WRITER_ROOT,
    KMP_WRITER_FIXED,
    KMP_WRITER_TURNS,
    KMP_WRITER_SLIDES,
    KMP_WRITER_FREE
} kmp_writer_joint;

typedef struct kmp_writer_link {
    const char *name, *joint; /* joint: its name, the name of its coordinate but for characters */
    int body;                 /* -1: without mass, between motions */
    int parent;               /* link, before it; -1: none */
    kmp_writer_joint kind;
    kmp_pose at;    /* its frame with coordinates zero, in the frame of its parent */
    double axis[3]; /* in its frame */
    double damping; /* of springs without stiffness */
    double stiffness, rest;
    double friction; /* a constant level */
    double armature; /* of the only motion of its body; a writer that has it sets it to zero */
} kmp_writer_link;

/** Work on a text. Parts that the format cannot say are named, each by its name, as warnings; in a strict context they
 * are errors. */
typedef struct kmp_export {
    const kempe_model *model;
    const char *format; /* its name */
    kmp_arena arena;
    kmp_text *text;
    kmp_writer_link *links; /* the ground is the first one */
    int count;
    int *of_body;      /* the link of a body */
    kmp_pose *in_link; /* the frame of a body in the frame of its link */
    int *of_motion;    /* the link that a coordinate moves, -1: the coordinate of a free body */
    bool *said;        /* of a closure: it is written */
    bool *said_force, *said_rope;
    const char **point_name;
    int drawn; /* shapes that are written */
    kempe_status status;
} kmp_export;

/** "FILE: WORDS" as a warning or error. */
void kmp_export_leave_out(kmp_export *w, const char *sentence, ...) __attribute__((format(printf, 2, 3)));

/** The pose of a point in the frame of its link. */
kmp_pose kmp_export_point(const kmp_export *w, int point);

/** Mass, and if there is one, the place of its centre in the link and the tensor about it. False: no mass, no inertia.
 */
bool kmp_export_mass(const kmp_export *w, int link, double *mass, double com[3], double inertia[6]);

/** Numbers between blanks; as an attribute, after a blank; a pose as its place and angles about the fixed axes x, y, z.
 */
void kmp_export_numbers(kmp_text *text, int count, const double *values);
void kmp_export_attribute(kmp_text *text, const char *key, int count, const double *values);
void kmp_export_angles(const kmp_pose *pose, double rpy[3]);

/** A name of the file for attributes: letters, digits, blanks, - and _. */
void kmp_export_name(kmp_text *text, const char *name);

/** The coupler by which the coordinate of a link follows the coordinate of another, which is written now: a joint has
 * one. False: there is none that is not written. */
bool kmp_export_mimic(kmp_export *w, int link, int *leader, double *multiplier, double *offset);

/** Writes a coordinate as the only one that follows another: q = multiplier other + offset. False: a closure of another
 * kind, with more terms, or one whose coordinates have no separate joint. */
bool kmp_export_follower(const kmp_export *w, const kmp_closure *closure, int *link, int *leader, double *multiplier,
                         double *offset);

/** The picture of a shape in the frame of its link. Cylinders and capsules are along z. */
typedef struct kmp_writer_shape {
    kmp_shape_kind kind;
    kmp_pose at;
    double size[3]; /* edges, radii of an ellipsoid, radius and length; of a mesh the scale */
    const char *mesh;
    double rgba[4];
    bool coloured;
} kmp_writer_shape;

/** True for a shape of a link that the format has: no lines, and not all have ellipsoids. It counts as written. */
bool kmp_export_shape(kmp_export *w, int shape, int link, bool ellipsoids, kmp_writer_shape *out);

/** A text between quotes or tags of XML. */
void kmp_export_text(kmp_text *text, const char *s);

/** The name of a point that no joint and no closure ends at, BODY_POINT, which no link, joint, loop and other point
 * has; NULL: it has one of these ends, or no name. */
const char *kmp_export_point_name(kmp_export *w, int point);

/* The writers. */
#define KMP_WRITER(word, write, name, meaning) void write(kmp_export *w);
#include "exchange/formats/writers.def"
#undef KMP_WRITER
