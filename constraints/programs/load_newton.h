/* SPDX-License-Identifier: BSD-3-Clause */
/* Newton's method for the multipliers nu that forces depend on, written out (load_passes.h runs it): each follows from
 * C and the state linearly,
 *
 *     Lambda_j = influence_j' C(nu) + constant_j,
 *
 * so that the residual is Lambda - nu and its matrix influence' dC/dnu - 1. */
#pragma once

#include "constraints/programs/program_writer.h"

typedef struct kmp_load_newton {
    int count, *at;    /* such rows of the partition; their positions among its independent rows */
    kmp_ref *nu;       /* their multipliers, which are inputs of C, */
    kmp_ref *residual; /* Lambda - nu, */
    kmp_ref *step;     /* and Newton's step */
    kmp_ref *matrix;   /* count x count, row by row */
} kmp_load_newton;

/** Lists the rows; multipliers of other rows that forces depend on are zero. Before kmp_writer_import, with room for
 * load_row_count replaced inputs. False: no memory. */
bool kmp_load_newton_init(kmp_load_newton *x, kmp_program_writer *w, const kmp_partition *part);

/** Takes the influence (n) of C on multiplier j, and the constant. */
void kmp_load_newton_take(kmp_load_newton *x, kmp_program_writer *w, const kmp_partition *part, int j,
                          const kmp_ref *influence, kmp_ref constant);

/** Writes the step, after all multipliers are taken. */
void kmp_load_newton_solve(kmp_load_newton *x, kmp_graph *g);

/** Puts C, the residual and the step: the outputs of a pass. */
void kmp_load_newton_put(const kmp_load_newton *x, kmp_program_writer *w);
int kmp_load_newton_outputs(const kmp_load_newton *x, const kmp_program_writer *w);

/** Values of the pass and of the stage after it, the last two of the writer, that do not depend on nu, into the stage
 * before, which has no outputs yet. Room for as many as the graph has nodes. False: no memory. */
bool kmp_load_newton_separate(kmp_program_writer *w);
