/* SPDX-License-Identifier: BSD-3-Clause */
/* Implicit blocks: unknowns y that solve F(y; p) = 0 for arguments p, as an operation of the graph. Newton's method
 * with the exact dF/dy runs wherever the program runs; where it does not converge the unknowns are NaN, and an
 * integrator takes a smaller step. The derivative is that of the implicit-function theorem: F_y dy + F_p dp = 0.
 *
 * Averages over places (average.h) are blocks, too: their components stand where unknowns do. */
#ifndef KMP_SYMBOLIC_IMPLICIT_H
#define KMP_SYMBOLIC_IMPLICIT_H

#include "symbolic/program/program.h"

enum { KMP_IMPLICIT_MOST = 6 }; /* unknowns */

typedef struct kmp_implicit kmp_implicit;

/** A block from a graph of its own, in which KMP_IN_Q[j] is unknown j and KMP_IN_PARAMETER[l] argument l: as many
 *  residuals and first guesses (which depend on arguments only) as unknowns. The block owns `local` in any case. NULL:
 *  no memory, or the local graph has an implicit block of its own. */
kmp_implicit *kmp_implicit_new(kmp_graph *local, int unknowns, int arguments, const kmp_ref *residual,
                               const kmp_ref *guess);

/** The same, begun at the best of several places: unknown 0 takes each candidate, the others their guesses, which may
 *  depend on unknown 0; Newton's method goes on from where `merit`, of arguments and unknowns, is least. The solution
 * is taken for the least merit nearby: one unknown alone stays in the basin that it begins in, where merit falls
 * towards it from both sides. guess[0] is not looked at. `candidates` at least 1. */
kmp_implicit *kmp_implicit_new_among(kmp_graph *local, int unknowns, int arguments, const kmp_ref *residual,
                                     const kmp_ref *guess, int candidates, const double *candidate, kmp_ref merit);

void kmp_implicit_free(kmp_implicit *block);

/** The same equations, first guesses and candidates, to the bit. */
bool kmp_implicit_equal(const kmp_implicit *a, const kmp_implicit *b);

/** What a program needs of it. */
const kmp_program_block *kmp_implicit_block(const kmp_implicit *block);

/** Number of the block in the graph, which owns it from now on; of an equal one that it has already, or else of this
 * one. -1: no memory. */
int kmp_graph_add_implicit(kmp_graph *g, kmp_implicit *block);
/** NULL when there is no such number. */
const kmp_implicit *kmp_graph_implicit(const kmp_graph *g, int block);

/** The unknowns for given arguments. */
void kmp_implicit_at(kmp_graph *g, int block, const kmp_ref *arguments, kmp_ref *unknowns);

/** One unknown for a list of arguments. */
kmp_ref kmp_implicit_component(kmp_graph *g, int block, int component, kmp_ref list);

/** Its derivative, given the list of differentials of the arguments (KMP_ZERO: all are zero). */
kmp_ref kmp_implicit_derivative(kmp_graph *g, int block, int component, kmp_ref list, kmp_ref differentials);

/* -- values ---------------------------------------------------------------------------------------- */

/** What runs the program of a block: the five functions of a back end (backend/machine.h). */
typedef struct kmp_block_runner {
    void *(*prepare)(const kmp_program *program); /* NULL: no memory */
    void (*release)(void *code);
    void (*set)(void *code, kmp_input_kind kind, const double *values);
    void (*run)(void *code, int stage);
    const double *(*outputs)(const void *code, int stage);
} kmp_block_runner;

/* Room to solve a block in: one for each thread. */
typedef struct kmp_solving kmp_solving;

/** The block must outlive it. Without a runner the program is interpreted. NULL: no memory. */
kmp_solving *kmp_solving_new(const kmp_program_block *block, const kmp_block_runner *runner);
void kmp_solving_free(kmp_solving *solving);

/** Where the arguments are to be put. */
double *kmp_solving_arguments(kmp_solving *solving);

/** An unknown for the arguments at hand. They alone decide: what was solved before is remembered, never continued. */
double kmp_solving_value(kmp_solving *solving, int component);

#endif
