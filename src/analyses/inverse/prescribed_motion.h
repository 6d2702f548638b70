/* SPDX-License-Identifier: BSD-3-Clause */
/* A mechanism along a prescribed motion. At each time some coordinates have the values of a table or of the model's
 * drives, and the others follow by the closures. Newton's method gives positions, one solution each rates and
 * accelerations. Small steps keep the branch where the path is long.
 *
 * A drive whose coordinate is in the table is ignored. Independent coordinates are among the coordinates of the table;
 * they are exchanged where they become ill-conditioned.
 *
 * States have values that the caller gives. Their motions move nothing else, and count as given. */
#pragma once

#include "base/arena.h"
#include "constraints/partition/reduction.h"

/** A motion given by points in time: values of some coordinates, with their rates and accelerations where these are
 * given too. Missing rates are the derivatives of the not-a-knot cubic through the values, missing accelerations the
 * derivatives of the cubic through the rates. Between points the motion is the quintic with value, rate and
 * acceleration of both ends. It has two continuous derivatives and reproduces all given values. */
typedef struct kmp_prescribed {
    kmp_arena arena; /* of all arrays */
    int count;       /* of coordinates */
    int *coordinate; /* ascending */
    int rows;
    double *t;        /* rows, ascending */
    double *value[3]; /* rows x count each: values, rates, accelerations */
    bool *given[3];   /* count each: they were, and not made */
    const char *cut;  /* a cut joint, whose columns do not count; NULL: none */
} kmp_prescribed;

/** An error of a table: the coordinate whose column has a missing value, and the row; coordinate -1: none. */
typedef struct kmp_gap_in_table {
    int coordinate, row, order; /* order: of value */
} kmp_gap_in_table;

/** A motion from columns of n coordinates (rows x n, NaN where no value is given), which must be given in every row or
 * in none. Only q determines the coordinates. False: a missing value, or no memory (coordinate -1). */
bool kmp_prescribed_init(kmp_prescribed *motion, int rows, const double *t, int n, const double *q, const double *qd,
                         const double *qdd, kmp_gap_in_table *gap);
void kmp_prescribed_free(kmp_prescribed *motion);

/** Values, rates and accelerations at t, each at its coordinate. t must be within the given times; at a row's time
 * the values equal the row exactly. */
void kmp_prescribed_at(const kmp_prescribed *motion, double t, double *q, double *qd, double *qdd);

/** The largest difference of dependent coordinates from their values in a table, over their scale. */
typedef struct kmp_off_table {
    double size, t;
    int coordinate; /* -1: no difference is possible */
} kmp_off_table;

typedef struct kmp_prescribed_motion {
    kmp_arena arena; /* of all arrays */
    const kempe_system *system;
    kmp_evaluator *eval;
    const kmp_prescribed *motion; /* not owned; NULL: only the drives */
    bool at_rest;                 /* no motion at all: the start, whose independent coordinates are not accelerated */
    const int *wish;              /* then: coordinates requested as independent, not owned */
    int wish_count;
    int n, m;
    bool *left_out;      /* m: rows that the table replaces */
    bool *given;         /* n: coordinates of the table, motions of states */
    const double *state; /* values of the states at the next instant, not owned; NULL: the values of the start */
    int *u;              /* n: room for the requested independent coordinates */
    double *masked;      /* J without those rows */
    kmp_partition part;
    kmp_reduction red;
    int *sign; /* of each block of Jv at its choice: a different sign at a trial means a different branch */
    double t, *q, *qd, *qdd;        /* n: the state */
    double *trial, *move;           /* n */
    double *ud, *udd, *rest;        /* n each: independent ones, and scratch */
    double *rows;                   /* m: scratch */
    double *from, *tq, *tqd, *tqdd; /* n: of the table */
    kmp_off_table off;
} kmp_prescribed_motion;

/** `motion` NULL and not `at_rest`: the drives determine all coordinates. KEMPE_E_MEMORY, KEMPE_E_ARGUMENT. */
kempe_status kmp_prescribed_motion_init(kmp_prescribed_motion *prescribed, const kempe_system *system,
                                        const char *backend, const kmp_prescribed *motion, bool at_rest,
                                        const int *wish, int wish_count);
void kmp_prescribed_motion_free(kmp_prescribed_motion *prescribed);

/** Takes the state at t: from the model's start, or from the table if it has all coordinates. KEMPE_E_FAILED, with the
 * reason: the start does not close, the given coordinates do not determine the motion, or the loops cannot be closed on
 * it. */
kempe_status kmp_prescribed_motion_start(kmp_prescribed_motion *prescribed, double t);

/** Advances to a later t. KEMPE_E_FAILED: the loops cannot be closed beyond a time, which the message gives. */
kempe_status kmp_prescribed_motion_advance(kmp_prescribed_motion *prescribed, double t);
