/* SPDX-License-Identifier: BSD-3-Clause */
/* Written programs that a system keeps for the choice of coordinates, rows and charts that they were written for
 * (dynamics/program_cache.h): a later run that begins with the same choice takes the program, and machine code with it.
 */
#pragma once

#include "constraints/programs/program_writer.h"
#include "dynamics/program_cache.h"

/** A program as its writer has made it. */
typedef struct kmp_program_record {
    kmp_program *program; /* NULL: there is none */
    kmp_eliminated *row;  /* of each multiplier of the elimination; allocated */
    int multipliers;
    int *layout, count; /* numbers of the writer, of its caller: positions of outputs */
} kmp_program_record;

/** The name of a program that depends on this choice in addition to the system: its evaluator's charts and dynamics, a
 * partition, an order of elimination (r; NULL: none) and the writer's own options. */
kmp_program_cache_name kmp_writer_name(const char *what, const kmp_evaluator *eval, const kmp_partition *part,
                                       const int *order, unsigned options);

/** Fills a record, whose layout and count the caller gives, with another holder of the program. False: it is not kept,
 * or there is no memory. */
bool kmp_writer_recall(const kempe_system *system, kmp_program_cache_name name, kmp_program_record *record);

/** Keeps a record, with another holder of its program: the first KMP_KEPT_CHOICES, and these in the cache too. */
void kmp_writer_keep(const kempe_system *system, kmp_program_cache_name name, const kmp_program_record *record);
