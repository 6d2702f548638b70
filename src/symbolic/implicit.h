/* SPDX-License-Identifier: BSD-3-Clause */
/* Implicit blocks: unknowns y that solve F(y; p) = 0 for arguments p, as an operation of the graph. Newton's method
 * with the exact dF/dy runs at each evaluation of the program; where it does not converge the unknowns are NaN, and an
 * integrator takes a smaller step. The derivative follows from the implicit-function theorem: F_y dy + F_p dp = 0.
 *
 * Averages over places are blocks, too: their components take the position of unknowns. These, and the merits of
 * candidates, are computed by a wing (base/wings.h), without which there are no such blocks. */
#pragma once

#include "symbolic/program.h"

struct kmp_setting;

enum { KMP_IMPLICIT_MOST = 6 }; /* unknowns: KMP_NEWTON_MOST */

typedef struct kmp_implicit kmp_implicit;

/** A block from a separate graph, in which KMP_IN_Q[j] is unknown j and KMP_IN_PARAMETER[l] argument l. It has as
 * many residuals and first guesses (which depend on arguments only) as unknowns. The block owns `local` in any case.
 * NULL: no memory, or the local graph has an implicit block. */
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

/** As kmp_graph_add_implicit, of a block as a program has it, only for evaluation: it has no derivatives. */
int kmp_graph_add_block(kmp_graph *g, const kmp_program_block *block);

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
    bool native; /* machine code: also at many places at once */
} kmp_block_runner;

/** Room to run a block at many places at once, for one thread. The block outlives it. */
typedef struct kmp_places_room {
    void *(*make)(const kmp_program_block *block, bool native); /* NULL: no memory */
    void (*release)(void *room);
    const double *(*run)(void *room, const double *arguments); /* until the next call; no allocation */
    kmp_counts (*count)(const void *room);                     /* of operations since it was made */
} kmp_places_room;

typedef struct kmp_places_wing {
    kmp_places_room averages, merits; /* all components; the merits of all candidates */
    kmp_ref (*derivative)(kmp_graph *g, int block, int component, kmp_ref list, kmp_ref differentials);
} kmp_places_wing;

/** That of this build; NULL: there is none. */
const kmp_places_wing *kmp_places_of_build(void);

/* A block with one list of arguments, and room to solve it in: one for each thread. */
typedef struct kmp_solving kmp_solving;

/* -- equations of a graph as a block of it ---------------------------------------------------------------- */

/* Makes equations of a graph an implicit block of it. Nodes that depend on the unknowns go into the block; the other
 * operands they need become its arguments, as late as possible. */

/** Unknown j while its equations are written. */
kmp_ref kmp_unknown(kmp_graph *g, int j);

/** Solutions y of residual(y) = 0 from first guesses that depend on no unknown. All are zero, and the graph has failed,
 * when there is no memory, or an equation contains a block that depends on the unknowns. */
void kmp_enclose(kmp_graph *g, int unknowns, const kmp_ref *residual, const kmp_ref *guess, kmp_ref *solution);

/** Puts the candidates into the block, in increasing order. false: no memory. */
bool kmp_block_candidates(kmp_implicit *block, int count, const double *candidate);

/** Converts references of a local graph to references of the enclosing one, in place. False: no memory. */
bool kmp_local_import(const struct kmp_setting *setting, const kmp_graph *local, int count, kmp_ref *refs);

/** The items of a list of the graph; KMP_ZERO is a list of zeros. */
void kmp_list_items(const kmp_graph *g, kmp_ref list, int count, kmp_ref *items);
