/* SPDX-License-Identifier: BSD-3-Clause */
/* The program of solved.c, made by solved_write.c. */
#pragma once

#include "constraints/programs/saddle_program.h"
#include "constraints/programs/writer_blocks.h"
#include "constraints/programs/writer_ldl.h"

/** Most unknowns, qdd and lambda, and most operations of a run: the preparation takes microseconds an operation, and
 * code beyond the second cache is no faster than loops over entries. */
enum { KMP_SADDLE_PROGRAM_UNKNOWNS = 400, KMP_SADDLE_PROGRAM_OPERATIONS = 100000 };

/* Unknowns of the program: q and qd, or a state (u, ud, v) of a reduction with its order of elimination. */
typedef struct kmp_saddle_program_plan {
    const kmp_partition *part;
    const kmp_reduction *red; /* NULL: q and qd */
    const int *order;         /* kmp_writer_order */
    bool closes;              /* with KMP_SADDLE_PROGRAM_CLOSE */
} kmp_saddle_program_plan;

typedef struct kmp_saddle_program_written {
    kmp_program *program; /* NULL: there is none */
    kmp_saddle_program_layout layout;
    kmp_eliminated *row; /* of each multiplier of the elimination; the caller's */
} kmp_saddle_program_written;

/** Finds the order of elimination by M and C, in the arena. False: no memory. */
bool kmp_saddle_program_order(const kmp_evaluator *eval, const kmp_partition *part, kmp_arena *arena,
                              kmp_writer_ldl *ldl);

/** kmp_saddle_program_write_nearby for a run of so many operations. False: no memory. */
bool kmp_saddle_program_write_near(const kmp_evaluator *eval, const kmp_partition *part, double run,
                                   kmp_program **program);

/** Operations of a run, before it is written; infinite if there is none, -1: no memory. */
double kmp_saddle_program_operations(const kmp_evaluator *eval, const kmp_partition *part);

/** Runs END, and lends h, J and h_t at the place of the last run, (t, q), to the evaluator. Returns the outputs. */
const double *kmp_saddle_program_end(kmp_writer_machine *made, const kmp_saddle_program_layout *layout,
                                     kmp_evaluator *eval, double t, const double *q);

/** kmp_saddle_program_is_cancelled by these outputs. */
bool kmp_saddle_program_cancels(const kmp_saddle_program_layout *layout, const kempe_system *system, const double *end,
                                double rtol, double rate_scale);

/** Writes the program of the cheaper dynamics, of those that the evaluator has, or takes the one that the system keeps
 * for this choice. False: no memory. */
bool kmp_saddle_program_write(const kmp_evaluator *eval, const kmp_saddle_program_plan *plan,
                              kmp_saddle_program_written *written);
