/* SPDX-License-Identifier: BSD-3-Clause */
/* The program of solved.c, made by solved_write.c. */
#ifndef KMP_CONSTRAINTS_EVALUATION_SOLVED_INSIDE_H
#define KMP_CONSTRAINTS_EVALUATION_SOLVED_INSIDE_H

#include "constraints/evaluation/solved.h"

/** Most unknowns, qdd and lambda, and most operations of a run: the preparation takes microseconds an operation, and
 * code beyond the second cache is no faster than loops over entries. */
enum { KMP_SOLVED_UNKNOWNS = 400, KMP_SOLVED_OPERATIONS = 100000 };

/** Writes the program of the cheaper dynamics, of those that the evaluator has. *program is NULL if there is none.
 * False: no memory. */
bool kmp_solved_write(const kmp_evaluator *eval, const kmp_partition *part, kmp_program **program, bool *by_bodies,
                      kmp_solved_layout *layout);

#endif
