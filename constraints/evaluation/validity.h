/* SPDX-License-Identifier: BSD-3-Clause */
/* Conditions of validity at a state: tables are used within their points, levels of friction are not negative, flexible
 * bodies deflect and turn within the limits of their shapes. The result of a state that violates one is doubted. */
#pragma once

#include "constraints/evaluation/evaluator.h"

/** Doubts a table that is used beyond an end at x, once for an evaluator. */
void kmp_eval_report_table(kmp_evaluator *eval, const kmp_named_table *table, int end, double x, double t);

/** The same for tables of outputs, with the values of kmp_eval_shown at a state. */
void kmp_eval_report_tables(kmp_evaluator *eval, double t, const double *shown);

/** The end of its table that use k of the system is beyond in the values of kmp_eval_shown; -1: none. *x: there. */
int kmp_eval_left(const kempe_system *system, const double *shown, int k, double *x);

/** Evaluates the conditions of validity of laws and closures at a state; false: there are none. `qdd` NULL: without
 * conditions that depend on accelerations and multipliers. Then the next one that is violated there, from condition
 * *from on, which becomes the one after it; -1: none. Studies of states judge deflections themselves. */
bool kmp_eval_validity(kmp_evaluator *eval, double t, const double *q, const double *qd, const double *qdd,
                       const double *lambda);
int kmp_eval_next_invalid(const kmp_evaluator *eval, int *from);
/** Doubts the state for condition k of kmp_eval_next_invalid, once for an evaluator. */
void kmp_eval_report_invalid(kmp_evaluator *eval, int k, double t);
/** Appends the sentence of that doubt. */
void kmp_eval_put_invalid(const kmp_evaluator *eval, int k, double t, kmp_text *text);

/** True if a condition of validity with this value is violated; `largest`: its largest size so far, of which the
 * rounding of a level is a part. */
bool kmp_condition_invalid(const kmp_condition *condition, double value, double largest);
/** True if two conditions have the same message: of either end of a table, of uses of one friction or body. */
bool kmp_validities_equal(const kmp_condition *a, const kmp_condition *b);
/** The end of the table (kmp_table_end) that a condition of validity has, and the place there with this value. */
int kmp_validity_end(const kmp_condition *condition, double value, double *x);
/** Doubts the motion for a condition of validity with this value at t. */
void kmp_doubt_condition(const kempe_system *system, const kmp_condition *condition, double value, double t);

/** The doubts: `end` as of kmp_table_end. */
#define KMP_TABLE_LEFT                                                                                                 \
    "table '%s' is used at %.6g, beyond its points %.6g .. %.6g, at t = %.6g s: it goes straight on there; %s"
#define KMP_LEVEL_PUSHES "friction '%s' has the level %.4g at t = %.6g s, which must not be negative: it would push"
#define KMP_TURNS_FASTER                                                                                               \
    "flexible body '%s' turns with %.4g rad/s, faster than its first frequency, %.4g rad/s: without terms of second "  \
    "order its stiffness is lost at this speed; %s"
#define KMP_TURNS_AVERAGED                                                                                             \
    "flexible body '%s' turns with %.4g rad/s, %.2f of its first frequency: %s, so that rates up to %.1f are right"
/** The advice at the end of a table: what a model may say of the table. */
const char *kmp_table_advice(const kmp_named_table *table);
void kmp_doubt_table(kempe_context *context, const kmp_named_table *table, int end, double x, double t);

/** Allocates the workspace of an evaluator in its arena. NULL: no memory. */
kmp_validity_marks *kmp_validity_marks_new(const kempe_system *system, kmp_arena *arena);
