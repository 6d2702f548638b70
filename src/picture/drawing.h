/* SPDX-License-Identifier: BSD-3-Clause */
/* The drawn parts of a model: the points of each body that make its shape, springs, guides of sliding joints,
 * curves of flexible bodies. */
#pragma once

#include "base/arena.h"
#include "base/text.h"
#include "model/data/pose.h"
#include <kempe/kempe.h>
#include <stdbool.h>

/** Marks at a point, as bits. */
enum {
    KMP_MARK_JOINT = 1,
    KMP_MARK_CLOSURE = 2,
    KMP_MARK_COM = 4,
    KMP_MARK_NAMED = 8,
    KMP_MARK_SLIDE = 16,
    KMP_MARK_HINGE = 32
};

enum { KMP_BEAM_PIECES = 16 };

/** A place of a flexible body, which is drawn as a separate body with the axes of its section: body_count and on,
 * where marks, lines and slides have a body. */
typedef struct kmp_drawn_place {
    int body; /* the flexible one */
    const kmp_station *station;
    double offset[3]; /* from the station, in the axes of its section */
    bool held;        /* a loop closes here: it is where it is, however large deformations are drawn */
    int along;        /* its number on the curve of its beam, whose places follow each other; -1: of none */
} kmp_drawn_place;

/** Numbers of the section of a flexible body. */
typedef struct kmp_drawn_section {
    double about[2], edge[2]; /* int y^2, int z^2; along y and z, 0: not known */
    double young, length;
    bool round, lengthens; /* lengthens: it has axial shapes */
} kmp_drawn_section;

/** A body that is carried by a place of a flexible one. */
typedef struct kmp_drawn_rider {
    int body, place;
} kmp_drawn_rider;

/** In the axes of its body. */
typedef struct kmp_mark {
    int body;
    unsigned marks;
    const char *name; /* of the joint, closure or point; NULL: none */
    double at[3];
    double axis[3]; /* of a hinge */
} kmp_mark;

/** A line between two points of bodies: a spring; a rod or a rope that runs through points. */
typedef struct kmp_line {
    const char *name;
    int body[2];
    double at[2][3];
    int of; /* the flexible body that it is a piece of; 0: none */
} kmp_line;

/** The first motion of a body is along a line of its parent: where that line begins and runs. */
typedef struct kmp_picture_slide {
    int motion, body; /* body: the parent */
    double at[3], axis[3];
    int slider;    /* the body that slides, */
    double end[3]; /* by this point of it */
} kmp_picture_slide;

typedef struct kmp_drawing {
    int body_count; /* drawn, the ground included: the first ones */
    kmp_mark *marks;
    int mark_count;
    kmp_line *lines; /* springs, rods and pieces of flexible bodies */
    bool *is_rod;
    int line_count;
    kmp_picture_slide *slides;
    int slide_count;
    kmp_drawn_place *places; /* of flexible bodies */
    int place_count;
    kmp_drawn_section *sections; /* of each flexible body, at the places of its curve */
    kmp_drawn_rider *riders;
    int rider_count;
    kmp_arena arena; /* of the arrays */
} kmp_drawing;

/** false: no memory. The names are the model's. */
bool kmp_drawing_init(kmp_drawing *drawing, const kempe_model *model, int most_bodies);
void kmp_drawing_free(kmp_drawing *drawing);

/** A point in the axes of a body, or of a place; body -1: it is not drawn. */
typedef struct kmp_drawn_point {
    int body;
    double at[3];
} kmp_drawn_point;

kmp_drawn_point kmp_drawing_point(const kmp_drawing *drawing, const kempe_model *model, int point);

/** Poses of all bodies of the model at the user's coordinates q, and of all places from body_count on, without bodies
 * that are not drawn: room for both. */
void kmp_drawing_poses(const kmp_drawing *drawing, const kempe_model *model, const double *q, kmp_pose *poses);

/** The displacement of each place from a body that is straight between its places that are held: shift, m, and turn, a
 * vector of small angles, three numbers each in the axes of the ground. Without any that are held this body has no
 * deformation. */
void kmp_drawing_deformation(const kmp_drawing *drawing, const kempe_model *model, const double *q,
                             const kmp_pose *poses, double *shift, double *turn);

/** The most places that a drawing of the model has; 0 without flexible bodies. */
int kmp_drawing_most_places(const kempe_model *model);

/** A square picture of `size` pixels at the user's coordinates q. False: no memory. */
bool kmp_mechanism_picture(kmp_text *svg, const kempe_model *model, const double *q, double size);
