/* SPDX-License-Identifier: BSD-3-Clause */
/* The linear algebra of a reduction written out, on the outputs of the motion program. Blocks of one and two rows
 * are solved by their determinant, larger ones by elimination in a given order. */
#pragma once

#include "constraints/programs/reduced_program_inside.h"

/** The right-hand side alone, in one stage, with the power left out, as a function of t, q and qd of the coordinates:
 * udd (p); qd of v (r); the least pivot of the reduced mass; kmp_writer_blocks_excess. Without contraction. NULL: no
 * memory, or forces that depend on multipliers. */
kmp_program *kmp_reduced_program_write_slopes(const kmp_reduction *red, const kmp_reduced_program_plan *plan);

/** Writes the program, or takes the one that the system keeps for this choice. */
kmp_reduced_program_written kmp_reduced_program_write(const kmp_reduction *red, const kmp_reduced_program_plan *plan);
