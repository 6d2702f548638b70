/* SPDX-License-Identifier: BSD-3-Clause */
/* Loop closures and drives, and the joints that were cut. */
#pragma once

#include "model/data/place.h"
#include "model/language/expression.h"
#include <kempe/kempe.h>
#include <stdbool.h>

struct kmp_gear;
struct kmp_cam_follower;

/** A coordinate times a factor. */
typedef struct kmp_term {
    int motion;
    kmp_number factor;
} kmp_term;

/* The rows of closure_kinds.def: KMP_CLOSURE_ball, KMP_CLOSURE_drive, .. */
typedef enum kmp_closure_kind {
    KMP_CLOSURE_NONE,
#define KMP_CLOSURE(name, ...) KMP_CLOSURE_##name,
#define KMP_INNER_CLOSURE      KMP_CLOSURE
#include "model/data/closure_kinds.def"
#undef KMP_CLOSURE
    KMP_CLOSURE_KINDS
} kmp_closure_kind;

/** A loop closure, mostly between two points, or a drive. Members that a kind does not use stay zero. */
typedef struct kmp_closure {
    const char *name;
    kmp_closure_kind kind;
    kmp_place place;
    int point[2];                 /* -1 when it is not between points */
    double axis[2][3];            /* in the axes of either point */
    kmp_number number;            /* of its row of closure_numbers.def; at t = 0 when it is a function of time */
    int motion;                   /* of a drive; of a coupling the first one, which determines its unit; else -1 */
    const kmp_expr *function;     /* a drive's coordinate and its number over t (NULL when constant); a constraint */
    kmp_term *terms;              /* of a coupling */
    int term_count;               /* 0: it couples nothing */
    const kmp_number *constant;   /* of a coupling; NULL: its value at the start */
    const kmp_named_table *table; /* of a curve from a table */
    int wheel;                    /* of a wheel's contact; meaningless otherwise */
    int force;                    /* of the kinds friction and touch: the element; meaningless otherwise */
    const kmp_expr *curve[2];     /* of a curve: over x, y, z of the first point's axes */
    int curve_side[2];            /* 1: y equals it, 2: z does; 0: it is zero on the curve */
    int curve_count;              /* number of curve expressions: rows */
    int power;                    /* of a constraint, and of a curve: its unit is m^power */
    struct kmp_gear *gear;        /* of a pair of gear wheels (gear.h); otherwise NULL */
    const struct kmp_cam_follower *cam; /* of a follower on a cam (cam.h); otherwise NULL */
} kmp_closure;

/** A joint between two bodies that became a closure of the same name, and the reason. */
typedef struct kmp_cut {
    const char *joint, *kind, *closure; /* its name, its kind, the kind of the closure */
    int rows;                           /* declared */
    const char *loop, *why;             /* the bodies of its loop; words */
    bool start_given;                   /* of one of its coordinates */
} kmp_cut;

/** A coordinate of a cut joint, which no equation has: a function of the coordinates of the tree. */
typedef struct kmp_cut_coordinate {
    const char *name, *joint; /* as kmp_motion has it */
    int number;               /* of the joint's coordinates, from 1 */
    bool rotation;
    const kmp_expr *value; /* KMP_EXPR_CUT */
    kmp_number q, qd;      /* of the start, where it gives them */
    bool q_given, qd_given;
} kmp_cut_coordinate;

/** Closure k of a model, and the number of closures. */
const kmp_closure *kmp_model_closure(const kempe_model *model, int k);
int kmp_model_closure_count(const kempe_model *model);

/** The multiplier of a closure that is not between points is an effort on coordinates. Its row has the unit m^k:
 * returns k, or -1 for a closure whose reaction is a force between bodies. */
int kmp_closure_effort_power(const kempe_model *model, const kmp_closure *closure);

/** The unit of the multiplier of a row of the unit m^power: an energy over the unit of the row. */
const char *kmp_multiplier_unit(int power);
