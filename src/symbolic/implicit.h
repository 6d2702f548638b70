/* SPDX-License-Identifier: BSD-3-Clause */
/* Implicit blocks: unknowns y that solve F(y; p) = 0 for arguments p, as an operation of the graph. Newton's method
 * with the exact dF/dy runs at each evaluation of the program; where it does not converge the unknowns are NaN, and an
 * integrator takes a smaller step. The derivative follows from the implicit-function theorem: F_y dy + F_p dp = 0.
 *
 * Averages over places (average.h) are blocks, too: their components take the position of unknowns. */
#pragma once

#include "symbolic/program.h"
#include "symbolic/row_code.h"

enum { KMP_IMPLICIT_MOST = 6 }; /* unknowns: KMP_NEWTON_MOST */

typedef struct kmp_implicit kmp_implicit;

/** A block from a graph of its own, in which KMP_IN_Q[j] is unknown j and KMP_IN_PARAMETER[l] argument l. It has as
 * many residuals and first guesses (which depend on arguments only) as unknowns. The block owns `local` in any case.
 * NULL: no memory, or the local graph has an implicit block of its own. */
kmp_implicit *kmp_implicit_new(kmp_graph *local, int unknowns, int arguments, const kmp_ref *residual,
                               const kmp_ref *guess);

/** A block that starts from the best of several candidates: unknown 0 takes each candidate, the others their guesses,
 * which may depend on unknown 0. Newton's method continues from the candidate where `merit`, of arguments and unknowns,
 * is least. The solution is taken for the least merit nearby: a single unknown stays in the basin in which it starts,
 * where merit falls towards it from both sides. guess[0] is ignored. Without candidates, and otherwise, as
 * kmp_implicit_new. */
kmp_implicit *kmp_implicit_new_among(kmp_graph *local, int unknowns, int arguments, const kmp_ref *residual,
                                     const kmp_ref *guess, int candidates, const double *candidate, kmp_ref merit);

void kmp_implicit_free(kmp_implicit *block);

/** True if equations, first guesses and candidates are equal, to the bit. */
bool kmp_implicit_equal(const kmp_implicit *a, const kmp_implicit *b);

/** The block's data for a program. */
const kmp_program_block *kmp_implicit_block(const kmp_implicit *block);

/** Number of the block in the graph, which owns it from now on; the number of an equal block if the graph has one. -1:
 * no memory, or no block: the graph has then failed. */
int kmp_graph_add_implicit(kmp_graph *g, kmp_implicit *block);
/** The same for a block as a program has it, for evaluation alone: it has no derivatives. */
int kmp_graph_add_block(kmp_graph *g, const kmp_program_block *block);
/** NULL when there is no such number. */
const kmp_implicit *kmp_graph_implicit(const kmp_graph *g, int block);

/** The unknowns for given arguments; unchanged if the block is -1. */
void kmp_implicit_at(kmp_graph *g, int block, const kmp_ref *arguments, kmp_ref *unknowns);

/** One unknown for a list of arguments. */
kmp_ref kmp_implicit_component(kmp_graph *g, int block, int component, kmp_ref list);

/** The derivative of an unknown, given the list of differentials of the arguments (KMP_ZERO: all are zero). */
kmp_ref kmp_implicit_derivative(kmp_graph *g, int block, int component, kmp_ref list, kmp_ref differentials);

/* -- values ---------------------------------------------------------------------------------------- */

/** The functions that run a block's program: functions of a back end (backend/machine.h). */
typedef struct kmp_block_runner {
    void *(*prepare)(const kmp_program *program); /* NULL: no memory */
    void (*release)(void *code);
    void (*set)(void *code, kmp_input_kind kind, const double *values);
    void (*run)(void *code, int stage);
    const double *(*outputs)(const void *code, int stage);
    kmp_row_writer *rows; /* of scans; NULL: these are interpreted */
} kmp_block_runner;

/* A block with one list of arguments, and room to solve it in: one for each thread. */
typedef struct kmp_solving kmp_solving;

/** The block must outlive it. Without a runner the program is interpreted. NULL: no memory. */
kmp_solving *kmp_solving_new(const kmp_program_block *block, const kmp_block_runner *runner);
/** The block of another one with another list of arguments, in the other's room: both belong to one thread, and the
 * other outlives it. NULL: no memory. */
kmp_solving *kmp_solving_beside(const kmp_solving *other);

/** Lets one that was made beside another use the code and the room of a third one of the same block. */
void kmp_solving_move(kmp_solving *s, const kmp_solving *other);
void kmp_solving_free(kmp_solving *solving);

/** Operations of the block's program since it was made; those of a room count once, for the solving that owns it.
 * Without the solution of linear equations, and the sums of averages. */
kmp_counts kmp_solving_count(const kmp_solving *solving);

/** True once it has been solved. */
bool kmp_solving_is_done(const kmp_solving *solving);

/** The array to write the arguments to. */
double *kmp_solving_arguments(kmp_solving *solving);

/** An unknown for the current arguments. It depends on them alone: earlier solutions are kept for equal arguments,
 * never used as starting values. */
double kmp_solving_value(kmp_solving *solving, int component);

/** Another unknown for the arguments of the last call of kmp_solving_value. */
double kmp_solving_component(const kmp_solving *solving, int component);

/* -- equations of a graph as a block of it ---------------------------------------------------------------- */

/* Makes equations of a graph an implicit block of it. Nodes that depend on the unknowns go into the block; the other
 * operands they need become its arguments, as late as possible. */

/** Unknown j while its equations are written. */
kmp_ref kmp_unknown(kmp_graph *g, int j);

/** Solutions y of residual(y) = 0 from first guesses that depend on no unknown. All are zero, and the graph has failed,
 * when there is no memory, or an equation contains a block that depends on the unknowns. */
void kmp_enclose(kmp_graph *g, int unknowns, const kmp_ref *residual, const kmp_ref *guess, kmp_ref *solution);
