/* SPDX-License-Identifier: BSD-3-Clause */
/* The drawn parts of a model: the points of each body that make its shape, springs, guides of sliding joints. */
#pragma once

#include "base/arena.h"
#include "base/text.h"
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

/** In the axes of its body. */
typedef struct kmp_mark {
    int body;
    unsigned marks;
    const char *name; /* of the joint, closure or point; NULL: none */
    double at[3];
    double axis[3]; /* of a hinge */
} kmp_mark;

/** A line between two points of bodies. */
typedef struct kmp_line {
    const char *name;
    int body[2];
    double at[2][3];
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
    kmp_line *lines; /* springs and rods */
    bool *is_rod;
    int line_count;
    kmp_picture_slide *slides;
    int slide_count;
    kmp_arena arena; /* of the arrays */
} kmp_drawing;

/** false: no memory. The names are the model's. */
bool kmp_drawing_init(kmp_drawing *drawing, const kempe_model *model, int most_bodies);
void kmp_drawing_free(kmp_drawing *drawing);

/** A square picture of `size` pixels at the user's coordinates q. False: no memory. */
bool kmp_mechanism_picture(kmp_text *svg, const kempe_model *model, const double *q, double size);
