/* SPDX-License-Identifier: BSD-3-Clause */
/* The solution of the saddle system written out, on the outputs of a motion program. */
#pragma once

#include "constraints/programs/saddle_program_inside.h"

/** The obstacle to a program for every choice of rows, as part of a sentence: implicit blocks, forces that depend on
 * multipliers, too many coordinates and independent rows. NULL: there is none. */
const char *kmp_saddle_program_obstacle(const kempe_system *system, int unknowns);

/** Finds the order of elimination by M and C, in the arena. False: no memory. */
bool kmp_saddle_program_order(const kmp_evaluator *eval, const kmp_partition *part, kmp_arena *arena,
                              kmp_writer_ldl *ldl);

/** Operations of a run, before it is written; infinite if there is none, -1: no memory. */
double kmp_saddle_program_operations(const kmp_evaluator *eval, const kmp_partition *part);

/** Writes the program of the cheaper dynamics, of those that the evaluator has, or takes the one that the system keeps
 * for this choice. False: no memory. */
bool kmp_saddle_program_write(const kmp_evaluator *eval, const kmp_saddle_program_plan *plan,
                              kmp_saddle_program_written *written);
