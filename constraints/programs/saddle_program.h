/* SPDX-License-Identifier: BSD-3-Clause */
/* Accelerations and multipliers as one program of (t, q, qd) for a choice of independent rows: the equations of motion,
 * and the solution of their saddle system written out with them, so that zeros and unused values are left out,
 *
 *     M = L D L'      S = J M^-1 J'      S lambda = J M^-1 C - jdqd      M qdd = J' lambda - C
 *
 * or, by articulated bodies, S and M^-1 J' from their recursion. It runs as scalar machine code, or in the lanes of
 * vector registers. Needs M positive definite and J of full rank; digits are lost where a pivot is
 * small, which each run reports. */
#pragma once

#include "constraints/closing/close.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/partition/partition.h"
#include "constraints/programs/program_writer.h"

/* Stages. CLOSE belongs to a program which closes the loops of a state: the correction dv of v, and the angles by which
 * it turns sines and cosines. The others are then at v + dv. RUN has the inputs KMP_IN_TIME, KMP_IN_Q, KMP_IN_QD and,
 * with a user-defined force, KMP_IN_EFFORT. END has the values of the closures at the place of RUN, and what
 * kmp_saddle_program_is_cancelled needs. CORRECT has the input KMP_IN_MU, a violation by rows of h (m; rows that are
 * not independent are not read), and uses the factors of RUN. FACTORS has these factors.
 *
 * Of a state (u, ud, v) of the reduced formulation, given as KMP_IN_Q, RUN gives udd and qd of v. ROW, in the place of
 * CORRECT, has qdd of v and the multipliers, by independent rows in the order of the partition. RATES gives qd of v
 * to a user-defined force that needs it before; otherwise RATES is empty and need not be run.
 *
 * If forces depend on multipliers, CLOSE has all values that these do not change, and RATES the outputs of a pass
 * (load_passes.h). */
enum {
    KMP_SADDLE_PROGRAM_CLOSE = 1,
    KMP_SADDLE_PROGRAM_RATES,
    KMP_SADDLE_PROGRAM_RUN,
    KMP_SADDLE_PROGRAM_END,
    KMP_SADDLE_PROGRAM_CORRECT,
    KMP_SADDLE_PROGRAM_FACTORS,
    KMP_SADDLE_PROGRAM_ROW = KMP_SADDLE_PROGRAM_CORRECT /* of a state */
};

/** Positions of the outputs in their stages. */
typedef struct kmp_saddle_program_layout {
    int n, r, pivots, multipliers; /* coordinates, independent rows, pivots, multipliers of the elimination */
    int stage;                     /* RUN */
    int qdd, lambda;      /* RUN: n; r, by independent rows in the order of the partition. Of a state: p, udd; none */
    int rates;            /* of a state: r, qd of v, in RUN or in RATES */
    int power;            /* RUN: of non-conservative forces, user-defined forces and moving closures; -1: none */
    int pivot, diagonal;  /* RUN: pivots of M (none by articulated bodies), then of S; the diagonals of M and S */
    int turns, left;      /* CLOSE: number of angles; RUN: r, the correction that is left, of a program that closes */
    int h, jacobian, h_t; /* END: m, jacobian.count, m; h_t is -1 if there is none */
    int open;             /* END: n, accelerations with the loops open */
    int multiplier;       /* END: of a state: multipliers of the elimination of v */
    int dv;               /* END: of a state, in a program that does not close: r, the correction of v */
    int dx;               /* CORRECT: n, the mass-orthogonal correction with J dx = -violation */
    int factors;          /* FACTORS: their number; 0: by articulated bodies, or of a state */
    int by_bodies;        /* 1: the dynamics are derived by articulated bodies; 0: M and C */
} kmp_saddle_program_layout;

typedef struct kmp_saddle_program kmp_saddle_program;

/** Makes the program for the partition's independent rows. *program is NULL if there is none: implicit blocks, too many
 * operations, or bad pivots at the evaluator's last closure. KEMPE_E_MEMORY. */
kempe_status kmp_saddle_program_new(kmp_saddle_program **program, kmp_evaluator *eval, const kmp_partition *part);
void kmp_saddle_program_free(kmp_saddle_program *program);

/** The number of evaluations of this number of operations after which the program pays: as many as it saves in its
 * making. A run that ends before does without. 0: so few that it is made at once, or it is needed for several stages in
 * `lanes`; LONG_MAX: it never does; -1: no memory. */
long kmp_saddle_program_wait(const kmp_evaluator *eval, const kmp_partition *part, double operations, bool lanes);

const kmp_saddle_program_layout *kmp_saddle_program_layout_of(const kmp_saddle_program *program);

/** Operation count of RUN. */
kmp_counts kmp_saddle_program_count(const kmp_saddle_program *program);

/** True if the program may be used now: conditions are frozen (kmp_eval_freeze), no further forces are given
 * (kmp_eval_set_effort), and it is not stale. True if it must be made again, because of other charts. */
bool kmp_saddle_program_applies(kmp_saddle_program *program);
bool kmp_saddle_program_is_stale(kmp_saddle_program *program);

/** Runs at (t, q, qd), with the evaluator's charts and frozen conditions. Returns the outputs of RUN, valid until the
 * next run, which may be NaN. *good: pivots are positive and have not lost many digits, and multipliers that forces
 * depend on have settled; the evaluator has these then. No allocation. */
const double *kmp_saddle_program_run(kmp_saddle_program *program, double t, const double *q, const double *qd,
                                     bool *good);

/** True if the pivots of a run are good: outputs of RUN, of which value k is at k stride. */
bool kmp_saddle_program_is_good(const kmp_saddle_program_layout *layout, const double *out, int stride);

/** Lends h, J and h_t at the place of the last run, (t, q), to the evaluator, until the next run. */
void kmp_saddle_program_lend(kmp_saddle_program *program, double t, const double *q);

/** True if rounding shows in accelerations at a relative tolerance, `rate_scale` the size of rates: accelerations
 * with the loops open, of which they are a part, are so large because some joint moves almost no inertia. After
 * kmp_saddle_program_lend.
 */
bool kmp_saddle_program_is_cancelled(const kmp_saddle_program *program, double rtol, double rate_scale);

/** The mass-orthogonal correction dx (n) with J dx = -violation (m), with the factors of the last run. */
void kmp_saddle_program_correct(kmp_saddle_program *program, const double *violation, double *dx);

/** Closer along the mass-orthogonal direction, with factors at rates qd (n); dx: n values of work space. It places the
 * evaluator by kmp_saddle_program_lend. `program` must apply. */
typedef struct kmp_saddle_program_closing {
    kmp_saddle_program *program;
    const double *qd;
} kmp_saddle_program_closing;
kmp_closer kmp_saddle_program_closer(kmp_saddle_program_closing *closing, double *dx);

/** The program, whose inputs and outputs are those above; with user-defined forces these are inputs. */
const kmp_program *kmp_saddle_program_code(const kmp_saddle_program *program);

/** A program of one stage that improves accelerations and multipliers at a place near the place of a RUN, with its
 * factors,
 *
 *     [M0 J0'; J0 0] (dqdd; -dlambda) = -(M qdd + C - J' lambda; J qdd + gamma),
 *
 * M0 and J0 at the RUN. The error that remains is in proportion to the distance of both places. It needs no further
 * factors. Inputs as RUN, KMP_IN_MU the factors, KMP_IN_QDD and KMP_IN_LAMBDA (r) what is to be improved. Outputs: both
 * improved, then the power if the system is dissipative. *program is NULL where there is none, or where it has more
 * than KMP_SADDLE_PROGRAM_NEARBY of the operations of RUN. The caller frees it. KEMPE_E_MEMORY. */
kempe_status kmp_saddle_program_write_nearby(const kmp_saddle_program *program, const kmp_partition *part,
                                             kmp_program **nearby);
#define KMP_SADDLE_PROGRAM_NEARBY 0.7

/** Runs END, and lends h, J and h_t at the place of the last run, (t, q), to the evaluator. Returns the outputs. */
const double *kmp_saddle_program_end(kmp_writer_machine *made, const kmp_saddle_program_layout *layout,
                                     kmp_evaluator *eval, double t, const double *q);

/** kmp_saddle_program_is_cancelled by these outputs. */
bool kmp_saddle_program_cancels(const kmp_saddle_program_layout *layout, const kempe_system *system, const double *end,
                                double rtol, double rate_scale);

/** Most unknowns, qdd and lambda, and most operations of a run: the preparation takes microseconds an operation, and
 * code beyond the second cache is not faster than loops over entries. */
enum { KMP_SADDLE_PROGRAM_UNKNOWNS = 400, KMP_SADDLE_PROGRAM_OPERATIONS = 100000 };

/* Unknowns of the program: q and qd, or a state (u, ud, v) of a reduction with its order of elimination. */
typedef struct kmp_saddle_program_plan {
    const kmp_partition *part;
    const kmp_reduction *red; /* NULL: q and qd */
    const int *order;         /* kmp_writer_order */
    bool closes;              /* with KMP_SADDLE_PROGRAM_CLOSE. The program of a state does not, and takes no
                               * user-defined forces, where forces depend on multipliers: these need the same stages */
} kmp_saddle_program_plan;

typedef struct kmp_saddle_program_written {
    kmp_program *program; /* NULL: there is none */
    kmp_saddle_program_layout layout;
    kmp_eliminated *row; /* of each multiplier of the elimination; the caller's */
} kmp_saddle_program_written;

/** The obstacle to a program for every choice of rows, as part of a sentence: implicit blocks, too many coordinates and
 * independent rows. NULL: there is none. */
const char *kmp_saddle_program_obstacle(const kempe_system *system, int unknowns);

/** Operations of a run, before it is written; infinite if there is none, -1: no memory. */
double kmp_saddle_program_operations(const kmp_evaluator *eval, const kmp_partition *part);

/** Writes the program of the cheaper dynamics, of the dynamics that the evaluator has, or takes the one that the system
 * keeps for this choice. False: no memory. */
bool kmp_saddle_program_write(const kmp_evaluator *eval, const kmp_saddle_program_plan *plan,
                              kmp_saddle_program_written *written);

/** kmp_saddle_program_write_nearby for a run of this number of operations. False: no memory. */
bool kmp_saddle_program_write_near(const kmp_evaluator *eval, const kmp_partition *part, double run,
                                   kmp_program **program);
