/* SPDX-License-Identifier: BSD-3-Clause */
/* Results say of a state that a table is used beyond its points, and that a level of friction is negative. */
#pragma once

#include "constraints/evaluation/evaluator.h"

/** Doubts a table that is used beyond an end at x, once for an evaluator. */
void kmp_eval_tell_table(kmp_evaluator *eval, const kmp_named_table *table, int end, double x, double t);

/** The same for tables of outputs, with the values of kmp_eval_shown at a state. */
void kmp_eval_tell_shown(kmp_evaluator *eval, double t, const double *shown);

/** The end of its table that use k of the system is beyond in the values of kmp_eval_shown; -1: none. *x: there. */
int kmp_eval_left(const kempe_system *system, const double *shown, int k, double *x);

/** Evaluates the conditions of laws and closures that are told at a state; false: there are none. `qdd` NULL: without
 * conditions that depend on accelerations and multipliers. Then the next one that is to be told there, from condition
 * *from on, which becomes the one after it; -1: none. Studies of states judge deflections themselves. */
bool kmp_eval_leaves(kmp_evaluator *eval, double t, const double *q, const double *qd, const double *qdd,
                     const double *lambda);
int kmp_eval_next_told(const kmp_evaluator *eval, int *from);
/** Doubts the state for condition k of kmp_eval_next_told, once for an evaluator. */
void kmp_eval_tell_condition(kmp_evaluator *eval, int k, double t);
/** Appends the sentence of that doubt. */
void kmp_eval_put_told(const kmp_evaluator *eval, int k, double t, kmp_text *text);

/** True if a condition with this value is to be told; `largest`: its largest size so far, of which the rounding of a
 * level is a part. */
bool kmp_condition_tells(const kmp_condition *condition, double value, double largest);
/** True if what is told of one condition is told of the other. */
bool kmp_conditions_tell_the_same(const kmp_condition *a, const kmp_condition *b);
/** The end of the table of a condition that tells of one (kmp_table_end), and the place there with this value. */
int kmp_told_end(const kmp_condition *condition, double value, double *x);
/** Doubts what a condition tells with this value at t. */
void kmp_doubt_condition(const kempe_system *system, const kmp_condition *condition, double value, double t);

/** The doubt: `end` as of kmp_table_end. */
#define KMP_TABLE_LEFT                                                                                                 \
    "table '%s' is used at %.6g, beyond its points %.6g .. %.6g, at t = %.6g s: it goes straight on there; %s"
#define KMP_LEVEL_PUSHES "friction '%s' has the level %.4g at t = %.6g s, which must not be negative: it would push"
/** The advice at its end: what a model may say of the table. */
const char *kmp_table_advice(const kmp_named_table *table);
void kmp_doubt_table(kempe_context *context, const kmp_named_table *table, int end, double x, double t);

/** Allocates the workspace of an evaluator in its arena. NULL: no memory. */
kmp_left_tables *kmp_left_tables_new(const kempe_system *system, kmp_arena *arena);
