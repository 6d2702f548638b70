/* SPDX-License-Identifier: BSD-3-Clause */
/* Cams: smooth closed outlines by a table of the polar angle, by places, or by the motion of their follower; and what a
 * follower does on one: the path of a roller's centre, the support function of a flat face. */
#pragma once

#include "symbolic/table_function.h"

struct kmp_outline;

/* The rows of cam_laws.def. */
typedef enum kmp_cam_law_kind {
#define KMP_CAM_LAW(kind, ...) KMP_CAM_##kind,
#include "model/data/cam_laws.def"
#undef KMP_CAM_LAW
    KMP_CAM_LAWS
} kmp_cam_law_kind;

extern const char *const kmp_cam_law_words[KMP_CAM_LAWS];

/** A part of a law over x in [from, to]: the polynomial of x - from, and size sin(rate x + phase). */
typedef struct kmp_cam_piece {
    double from, to, power[8], size, rate, phase;
} kmp_cam_piece;

/** The pieces of a law, one after the other; *count of them. */
const kmp_cam_piece *kmp_cam_pieces(kmp_cam_law_kind law, int *count);

/** A derivative of order 0 to 3 of a piece, at x. */
double kmp_cam_piece_value(const kmp_cam_piece *piece, int derivative, double x);

/** The law at x in [0, 1], or a derivative by x of order 1 to 3; 0 and 1 outside. */
double kmp_cam_law_value(kmp_cam_law_kind law, int derivative, double x);

/** A part of the motion of a follower over angles of the cam. */
typedef struct kmp_cam_part {
    double from, to, rise; /* rad; m, 0: a dwell */
    kmp_cam_law_kind law;
} kmp_cam_part;

typedef enum kmp_follower_form { KMP_FOLLOWER_ROLLER, KMP_FOLLOWER_KNIFE, KMP_FOLLOWER_FLAT } kmp_follower_form;

/** A cam. The angle of a law is the one by which the cam has turned about z, from where its follower is on the x axis;
 * the angle of a table is the polar angle of a place, which decreases with it. */
typedef struct kmp_cam {
    const struct kmp_outline *outline;
    kmp_table *table;    /* the radius over the polar angle, periodic; of the model; NULL: by the members below */
    kmp_table *place[2]; /* x and y over a length, periodic; of the cam; NULL: by the motion of a follower */
    kmp_cam_part *parts; /* from 0 to one turn */
    int part_count;
    double base;            /* what the lift is counted from: of a roller or edge to its centre, m; of a lever, rad */
    kmp_follower_form form; /* of the law's follower */
    double radius;          /* of its roller */
    double offset;          /* of its line from the centre, to the right of the motion */
    double arm, pivot; /* of a lever: its length with the sign of its side, and the place of its bearing; 0: none */
} kmp_cam;

/** Frees what is not in the arena of the model; of NULL nothing. */
void kmp_cam_free(kmp_cam *cam);

/** The lift of a law at an angle of the cam, or a derivative by the angle of order 1 to 3. */
double kmp_cam_lift(const kmp_cam *cam, int derivative, double angle);

/** A follower on an outline. */
typedef struct kmp_cam_follower {
    const struct kmp_outline *outline;
    kmp_follower_form form;
    double radius; /* of a roller */
    bool leaves;   /* it is in contact, and may be anywhere outside the cam */
} kmp_cam_follower;

/** True for what a follower touches as one surface: a cam, and a whole circle that is solid. */
bool kmp_outline_is_smooth(const struct kmp_outline *outline);

/** Faults of a follower on a cam. */
typedef enum kmp_cam_fault {
    KMP_CAM_GOOD,
    KMP_CAM_HOLLOW,    /* the roller does not fit into a hollow */
    KMP_CAM_UNDERCUT,  /* the profile of a law has a cusp */
    KMP_CAM_NOT_FLAT,  /* a flat face on a hollow */
    KMP_CAM_NOT_ROUND, /* the path turns back about the centre */
    KMP_CAM_NOT_FOUND, /* the search for the place of contact misses it */
    KMP_CAM_NO_MEMORY
} kmp_cam_fault;

/** Newton's steps from the spline of kmp_cam_parameter to the place of contact. */
enum { KMP_CAM_STEPS = 2 };

typedef struct kmp_cam_check {
    kmp_cam_fault fault;
    double angle;     /* rad, polar */
    double curvature; /* 1/m, there */
    double off;       /* of a search: distance of the place that it finds, in parts of the whole curve */
} kmp_cam_check;

/** True if the follower is the one of the law: its motion is the law itself. With an offset or a lever there is no lift
 * at some distances from the centre, so that a contact is found on the curve. */
bool kmp_cam_is_exact(const kmp_cam *cam, const kmp_cam_follower *follower);

/** Checks a follower on a cam; of one whose place of contact is searched, the search at places between its nodes. */
kmp_cam_check kmp_cam_find_fault(const kmp_cam *cam, const kmp_cam_follower *follower);

/** The place at which the profile is hollow with the least radius; false: it is convex all round. */
bool kmp_cam_is_hollow(const kmp_cam *cam, kmp_cam_check *place);

/** The distance of the profile inside the curve that a law describes: the radius of the law's own roller. */
double kmp_cam_inset(const kmp_cam *cam);

/** The parameter of the base curve - the length of places, else an angle in rad - over the polar angle of a roller's
 * centre or an edge, or over the angle of the normal of a flat face, from -pi to pi. A spline through many places,
 * which the caller frees: Newton's steps begin at its value. NULL: *fault says why. */
kmp_table *kmp_cam_parameter(const kmp_cam *cam, const kmp_cam_follower *follower, kmp_cam_check *fault);

/** The path of a roller's centre or an edge at its k-th of `count` places, counter-clockwise. */
void kmp_cam_path_place(const kmp_cam *cam, const kmp_cam_follower *follower, int k, int count, double place[2]);

/** The profile of a cam or a circle at its k-th of `count` places, counter-clockwise. */
void kmp_outline_place(const struct kmp_outline *outline, int k, int count, double place[2]);
