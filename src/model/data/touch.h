/* SPDX-License-Identifier: BSD-3-Clause */
/* Two surfaces that may touch, or a limit of a coordinate or of an expression: what a contact is about, whatever its
 * law. Its distance, normal and place are expressions of dynamics/kinematics/touching.h. */
#pragma once

#include "model/language/expression.h"

typedef enum kmp_touch_shape {
    KMP_TOUCH_SPHERE,   /* about its point; of radius 0: only the point */
    KMP_TOUCH_CYLINDER, /* about an axis through its point; the first side touches a plane with its middle section */
    KMP_TOUCH_PLANE,    /* through its point */
    KMP_TOUCH_PROFILE,  /* the curve y = table(x) of its point's axes, solid below it */
    KMP_TOUCH_PIECE,    /* second side: a piece of an outline in the x-y plane of its point's axes */
    KMP_TOUCH_CAM,      /* second side: a cam in the x-y plane of its point's axes */
    KMP_TOUCH_FACE      /* first side: a flat face through its point, which touches a cam */
} kmp_touch_shape;

typedef struct kmp_touch_side {
    kmp_touch_shape shape;
    int point;
    int axis;                     /* 0, 1, 2 of the point's axes: of a cylinder; the normal of a plane or a face */
    bool against;                 /* PLANE, FACE: its normal, away from a cam, is opposite to that axis */
    bool hollow;                  /* second side: the first one is inside it */
    const kmp_named_table *table; /* PROFILE */
    const struct kmp_outline_part *piece; /* PIECE */
    bool off;                             /* first side: its centre is not at its point, but there: */
    double at[2];                         /* in the x-y plane of the point's axes */
    const struct kmp_cam_follower *cam;   /* CAM: with what the first side is (cam.h) */
} kmp_touch_side;

struct kmp_outline;

/** The contacts, or the friction, of the pairs of circles and pieces of one contact with outlines: forces `first`,
 * `first + step`, .. */
typedef struct kmp_outline_contact {
    const char *name;
    int first, count, step;
    const struct kmp_outline *outline[2]; /* of both sides, at these points; NULL: none */
    int point[2];
} kmp_outline_contact;

typedef struct kmp_contact_pair {
    const kmp_expr *gap;       /* the distance itself; NULL: by the members below */
    int motion;                /* a coordinate with a limit; -1: two sides */
    bool upper;                /* the limit is the largest value */
    bool turns;                /* the distance is an angle */
    kmp_number limit;          /* of the coordinate */
    const kmp_expr *clearance; /* of a journal, whose centre is at vector[] of the force; NULL: it is none */
    const kmp_expr *way;       /* with a gap: a length whose rate is the velocity of the surfaces along each other */
    const kmp_expr *slip;      /* with a gap: that velocity, where no length of the coordinates has it; NULL: none */
    kmp_touch_side side[2];    /* the first one is a sphere or a cylinder; next to a gap: a ball in its socket */
    kmp_number radius[2];
} kmp_contact_pair;
