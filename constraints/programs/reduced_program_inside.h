/* SPDX-License-Identifier: BSD-3-Clause */
/* The program of reduced_program.c, made by reduced_program_write.c. */
#pragma once

#include "constraints/programs/writer_blocks.h"

/* Bounds: independent coordinates in one run, for which that by the saddle system is better beyond; of any program. */
enum { KMP_REDUCED_PROGRAM_FREEDOMS = 8, KMP_REDUCED_PROGRAM_MOST = 48 };

/* Stages: where it is asked for, the correction dv of v, and the angles by which it turns sines and cosines; then, at v
 * + dv, qd of v from (t, q) and qd of u; udd, then the pivots of the reduced mass; values for the end of a step.
 * Without user-defined forces, which are functions of qd, the second stage has all of these: udd, qd of v, pivots,
 * power. With KMP_REDUCED_PROGRAM_CLOSE it ends with the next correction. */
enum {
    KMP_REDUCED_PROGRAM_CLOSE = 1,
    KMP_REDUCED_PROGRAM_RATES,
    KMP_REDUCED_PROGRAM_ACCELERATIONS,
    KMP_REDUCED_PROGRAM_END,
    KMP_REDUCED_PROGRAM_STAGES
};

/* If forces depend on multipliers, the first stage has all values that these do not change. With multipliers nu of the
 * load rows of the partition as KMP_IN_LAMBDA the second one has C (n), Lambda(nu) - nu of these rows, and the step of
 * Newton's method to their solution. The third one has all of the right-hand side
 * (constraints/evaluation/load_multipliers.h). */

/* Outputs of the last stage: the multipliers of the elimination in the blocks, a pivot or determinant for each factor
 * of det Jv, h, J, h_t if there is one, Bvu, the correction of v; with KMP_REDUCED_PROGRAM_CLOSE also the parts of qd
 * and qdd of v that do not depend on ud and udd. On request the second of these alone. */
typedef struct kmp_reduced_program_layout {
    int multipliers, pivots, turns;
    int loads; /* number of load rows in the partition */
} kmp_reduced_program_layout;

/** A program; the caller frees the first two. */
typedef struct kmp_reduced_program_written {
    kmp_program *program; /* NULL: no memory */
    kmp_eliminated *row;  /* of each multiplier */
    kmp_reduced_program_layout layout;
} kmp_reduced_program_written;

/** Options of the program. */
typedef struct kmp_reduced_program_plan {
    const int *order;          /* of rows in the elimination: r positions among the independent rows, block by block */
    const kmp_program *motion; /* with the system's patterns; NULL: that of the system */
    bool power;                /* power of non-conservative forces, after the pivots of the reduced mass */
    bool closes;               /* with KMP_REDUCED_PROGRAM_CLOSE */
    bool drives;               /* the power has that of closures that move in time */
    bool curvature;            /* the last stage ends with the part of qdd of v that does not depend on udd */
    bool forces;               /* and then with the multipliers of the independent rows */
} kmp_reduced_program_plan;
