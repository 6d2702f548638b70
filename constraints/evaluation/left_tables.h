/* SPDX-License-Identifier: BSD-3-Clause */
/* Tables that are used beyond their points. */
#pragma once

#include "constraints/evaluation/evaluator.h"

/** Doubts a table that is used beyond an end at x, once for an evaluator. */
void kmp_eval_tell_table(kmp_evaluator *eval, const kmp_named_table *table, int end, double x, double t);

/** The same for tables of outputs, with the values of kmp_eval_shown at a state. */
void kmp_eval_tell_shown(kmp_evaluator *eval, double t, const double *shown);

/** The end of its table that use k of the system is beyond in the values of kmp_eval_shown; -1: none. *x: there. */
int kmp_eval_left(const kempe_system *system, const double *shown, int k, double *x);

/** Evaluates the ends of tables of laws and closures at a state; false: there are none. `qdd` NULL: without tables that
 * depend on accelerations and multipliers. Then the next table that is used
 * beyond its points there, from condition *from on, which becomes the one after it; NULL: none. */
bool kmp_eval_leaves(kmp_evaluator *eval, double t, const double *q, const double *qd, const double *qdd,
                     const double *lambda);
const kmp_named_table *kmp_eval_next_left(const kmp_evaluator *eval, int *from, int *end, double *x);

/** The doubt: `end` as of kmp_table_end. */
#define KMP_TABLE_LEFT                                                                                                 \
    "table '%s' is used at %.6g, beyond its points %.6g .. %.6g, at t = %.6g s: it goes straight on there; %s"
/** The advice at its end: what a model may say of the table. */
const char *kmp_table_advice(const kmp_named_table *table);
void kmp_doubt_table(kempe_context *context, const kmp_named_table *table, int end, double x, double t);

/** Allocates the workspace of an evaluator in its arena. NULL: no memory. */
kmp_left_tables *kmp_left_tables_new(const kempe_system *system, kmp_arena *arena);
