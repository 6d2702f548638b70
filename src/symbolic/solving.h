/* SPDX-License-Identifier: BSD-3-Clause */
/* Values of implicit blocks: Newton's method (newton.h) on a block's program, and averages. */
#pragma once

#include "symbolic/implicit.h"

/** The block must outlive it. Without a runner the program is interpreted. NULL: no memory. */
kmp_solving *kmp_solving_new(const kmp_program_block *block, const kmp_block_runner *runner);
/** The block of another one with another list of arguments, in the other's room: both belong to one thread, and the
 * other outlives it. NULL: no memory. */
kmp_solving *kmp_solving_beside(const kmp_solving *other);

/** Lets one that was made in addition to another use the code and the room of a third one of the same block. */
void kmp_solving_move(kmp_solving *s, const kmp_solving *other);
void kmp_solving_free(kmp_solving *solving);

/** Operations of the block's program since it was made; the bytes of a room count once, for the solving that owns it.
 * Without the solution of linear equations, and the sums of averages. */
kmp_counts kmp_solving_count(const kmp_solving *solving);

/** True once it has been solved. */
bool kmp_solving_is_done(const kmp_solving *solving);

/** The array to write the arguments to. */
double *kmp_solving_arguments(kmp_solving *solving);

/** An unknown for the current arguments. It depends only on them: earlier solutions are kept for equal arguments,
 * never used as starting values. */
double kmp_solving_value(kmp_solving *solving, int component);

/** Another unknown for the arguments of the last call of kmp_solving_value. */
double kmp_solving_component(const kmp_solving *solving, int component);
