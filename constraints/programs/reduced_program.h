/* SPDX-License-Identifier: BSD-3-Clause */
/* The reduced right-hand side as one program for one choice of u: from t, q and ud to qd and udd, with zeros and unused
 * values left out. By the reduced mass, the linear algebra of eqs. (43)-(46) of Fisette and Samin 1996 is written out
 * with the equations; with many degrees of freedom the program of the saddle system (saddle_program.h). The numbers
 * equal the results of reduction.h but for rounding. */
#pragma once

#include "constraints/partition/reduction.h"
#include "constraints/programs/program_writer.h"
#include "constraints/programs/saddle_program.h"

typedef struct kmp_reduced_program kmp_reduced_program;

/** Makes the program from a reduction with its factors at the evaluator's last closure, whose values determine the
 * order of elimination. *program is NULL if there is none. By the reduced mass: large blocks, many degrees of freedom,
 * implicit blocks, forces that depend on multipliers in a program that closes; by the saddle system as
 * kmp_saddle_program_new. `closes`: it corrects v before (kmp_reduced_program_close). KEMPE_E_MEMORY. */
kempe_status kmp_reduced_program_new(kmp_reduced_program **program, const kmp_reduction *red, bool closes);
kempe_status kmp_reduced_program_new_by_saddle(kmp_reduced_program **program, const kmp_reduction *red, bool closes);
void kmp_reduced_program_free(kmp_reduced_program *program);

/** True for a program by the saddle system. */
bool kmp_reduced_program_is_by_saddle(const kmp_reduced_program *program);

/** Evaluates at (t, y), y = (u, ud, v), with the evaluator's charts and frozen conditions: dy = (ud, udd, vd), which
 * may be NaN. false: the reduced mass is not positive, Newton's method for multipliers that forces depend on, which
 * begins at the evaluator's, does not converge, or as kmp_saddle_program_run. No allocation. */
bool kmp_reduced_program_run(kmp_reduced_program *program, double t, const double *y, double *dy);

/** Correction of v, -Jv^-1 h, at (t, y): dv (r), owned by the program, and the largest angle by which it turns a sine
 * or cosine. If that is at most KMP_TURN_SMALL, kmp_reduced_program_finish does the rest of kmp_reduced_program_run at
 * v + dv, and kmp_reduced_program_left returns the correction (r) that is left there. kmp_reduced_program_run does all.
 */
kmp_writer_correction kmp_reduced_program_close(kmp_reduced_program *program, double t, const double *y);
bool kmp_reduced_program_finish(kmp_reduced_program *program, double t, const double *y, double *dy);
const double *kmp_reduced_program_left(const kmp_reduced_program *program);

/** The power of non-conservative forces, user-defined ones included, and of moving closures at the last run. */
double kmp_reduced_program_power(const kmp_reduced_program *program);

/** True if the program may be used now; true if it must be made again (kmp_writer_machine_applies, _is_stale). */
bool kmp_reduced_program_applies(kmp_reduced_program *program);
bool kmp_reduced_program_is_stale(kmp_reduced_program *program);

/** True if the program has the order of elimination that one would have that is made at the evaluator's last closure,
 * where the reduction is factored. */
bool kmp_reduced_program_fits(const kmp_reduced_program *program);

/** Values needed at the end of a step, at the place of the last kmp_reduced_program_run; valid until the next run. Not
 * by the saddle system. */
typedef struct kmp_reduced_program_end {
    bool good;                        /* the order of elimination is good; otherwise results may have lost digits */
    bool regular;                     /* Jv is regular */
    const int *signs;                 /* signs of its blocks, as from kmp_block_take_signs */
    const double *h, *jacobian, *h_t; /* as in kmp_evaluator */
    const double *bvu, *dv;           /* as in kmp_reduction: Bvu, the correction of v */
    const double *x_t, *a0;           /* r, of v, as there; NULL unless it closes */
} kmp_reduced_program_end;

kmp_reduced_program_end kmp_reduced_program_at_end(kmp_reduced_program *program);

/** By the saddle system, at the end of a step: lends h, J and h_t at the place of the last run, (t, q), to the
 * evaluator, until the next run; *cancelled: as kmp_saddle_program_is_cancelled. True: the order of elimination is
 * good. */
bool kmp_reduced_program_lend(kmp_reduced_program *program, double t, const double *q, double rtol, double rate_scale,
                              bool *cancelled);

/** True if the order of elimination is good at (t, y); by the saddle system, also its pivots. */
bool kmp_reduced_program_is_good(kmp_reduced_program *program, double t, const double *y);

/** A row of results at a state (u, ud, v) whose loops are to be closed, by a program that does not close stages. */
typedef struct kmp_reduced_program_row {
    kmp_reduced_program *program;
    double *y, *dy, *dx; /* 2 p + r, 2 p + r, r: the state, its derivative, room for corrections */
    const double *dv;    /* the last one */
    int corrections;     /* their number */
} kmp_reduced_program_row;

/** Closes v of q (n), which has u and v of row->y, to round-off, as kmp_reduction_close does. The evaluator's closure
 * then belongs to q, until the next run. false: it stays open, or the order of elimination or pivots are bad there.
 * After it qd, and accelerations and multipliers (m; zero for dropped rows). No allocation. */
bool kmp_reduced_program_close_row(kmp_reduced_program_row *row, double t, double *q);
void kmp_reduced_program_rates(const kmp_reduced_program_row *row, double *qd);
void kmp_reduced_program_complete_row(const kmp_reduced_program_row *row, double *qdd, double *lambda);

/** The program for kmp_lanes, whose inputs and outputs are as below, or as in saddle_program.h; NULL:
 * with user-defined forces it does not have all of the right-hand side. Positions of its outputs: of its stage of
 * slopes, and of END. */
const kmp_program *kmp_reduced_program_code(const kmp_reduced_program *program);
const kmp_saddle_program_layout *kmp_reduced_program_layout_of(const kmp_reduced_program *program);

/** Operations of an evaluation by kmp_reduced_program_code, by the reduced mass. Multipliers that forces depend on take
 * two passes. */
kmp_counts kmp_reduced_program_count(const kmp_reduced_program *program);

/* Bounds: independent coordinates in one run, beyond which the program by the saddle system is better; of any program.
 */
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
    KMP_REDUCED_PROGRAM_ROW, /* on request: qdd of v, and the multipliers of the independent rows */
    KMP_REDUCED_PROGRAM_STAGES
};

/* If forces depend on multipliers, the first stage has all values that these do not change. With multipliers nu of the
 * load rows of the partition as KMP_IN_LAMBDA the second one has C (n), Lambda(nu) - nu of these rows, and the step of
 * Newton's method to their solution. The third one has all of the right-hand side
 * (constraints/evaluation/load_multipliers.h). */

/* Outputs of the last stage: the multipliers of the elimination in the blocks, a pivot or determinant for each factor
 * of det Jv, h, J, h_t if there is one, Bvu, the correction of v; with KMP_REDUCED_PROGRAM_CLOSE also the parts of qd
 * and qdd of v that do not depend on ud and udd. On request only the second of these. */
typedef struct kmp_reduced_program_layout {
    int multipliers, pivots, turns;
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
    const kmp_program *motion; /* with the system's patterns; NULL: the pattern of the system */
    bool power;                /* power of non-conservative forces, after the pivots of the reduced mass */
    bool closes;               /* with KMP_REDUCED_PROGRAM_CLOSE */
    bool drives;               /* the power includes the power of closures that move in time */
    bool curvature;            /* the last stage ends with the part of qdd of v that does not depend on udd */
    bool forces;               /* and then with the multipliers of the independent rows */
    bool rows;                 /* with KMP_REDUCED_PROGRAM_ROW */
} kmp_reduced_program_plan;

/** Only the right-hand side, in one stage, with the power left out, as a function of t, q and qd of the coordinates:
 * udd (p); qd of v (r); the least pivot of the reduced mass; kmp_writer_blocks_excess. Without contraction. NULL: no
 * memory, or forces that depend on multipliers. */
kmp_program *kmp_reduced_program_write_slopes(const kmp_reduction *red, const kmp_reduced_program_plan *plan);

/** Writes the program, or takes the one that the system keeps for this choice. */
kmp_reduced_program_written kmp_reduced_program_write(const kmp_reduction *red, const kmp_reduced_program_plan *plan);
