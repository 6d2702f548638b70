/* SPDX-License-Identifier: BSD-3-Clause */
/* A pair of gear wheels, or a wheel and a rack: what its closure has besides its terms. */
#pragma once

#include "model/language/expression.h"
#include <stdbool.h>

typedef enum kmp_gear_form {
    KMP_GEAR_PARALLEL, /* spur and helical, external or internal */
    KMP_GEAR_BEVEL,    /* the axes meet */
    KMP_GEAR_WORM,     /* they cross at a right angle; the first wheel is the worm */
    KMP_GEAR_RACK      /* the second wheel is a rack */
} kmp_gear_form;

/** Numbers of a pair, with the keys of gear_keys.def. One that is absent has the value 0 and no expression. */
typedef enum kmp_gear_number {
    KMP_GEAR_RADIUS_1,
    KMP_GEAR_RADIUS_2,
    KMP_GEAR_MODULE,
    KMP_GEAR_HELIX,
    KMP_GEAR_LEAD,
    KMP_GEAR_PRESSURE,
    KMP_GEAR_NUMBERS
} kmp_gear_number;

extern const char *const kmp_gear_number_keys[KMP_GEAR_NUMBERS];

/** The terms of its closure are the coordinates that turn the first wheel against the carrier, with factors 1 or -1
 * about its axis, then the coordinates of the second one. */
typedef struct kmp_gear {
    kmp_gear_form form;
    int carrier;     /* the body in which both axes rest */
    int wheel[2];    /* bodies */
    int centre[2];   /* a point of each on its axis; -1: the body's origin */
    int axis[2];     /* the motion about whose axis (along which) each one moves */
    int first_count; /* terms of the first wheel */
    int outwards[2]; /* bevel: 1 if that axis leads from the apex to the wheel, otherwise -1 */
    int sense;       /* 1 if both wheels move in their positive direction, otherwise -1 */
    bool rigid;      /* otherwise contacts of both flanks, NAME_front and NAME_back, are in the place of a row */
    bool internal;
    int ring;             /* internal: the wheel with teeth inside; otherwise -1 */
    bool left;            /* the first wheel is left-handed */
    double efficiency[2]; /* where the first wheel drives, where the second one does; not positive: self-locking */
    double teeth[2];      /* of a worm its starts; 0: the radii are given */
    kmp_number number[KMP_GEAR_NUMBERS];
} kmp_gear;

static inline bool kmp_gear_has(const kmp_gear *gear, kmp_gear_number number)
{
    return gear->number[number].value != 0 || gear->number[number].expr;
}
