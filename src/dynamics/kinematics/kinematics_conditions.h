/* SPDX-License-Identifier: BSD-3-Clause */
/* Conditions: of expressions, and of elements, whose value in a graph is noted when their law or residual is derived
 * there. */
#pragma once

#include "dynamics/kinematics/link_tree.h"

void kmp_events_free(kmp_events *events);

/** The number of a condition by `of` and `number`, -1: none; adds one, whose text it takes, -1: no memory. */
int kmp_events_find(const kmp_events *events, const void *of, int number);
int kmp_events_add(kmp_events *events, kmp_condition condition);
void kmp_noted_free(kmp_noted *noted);

/** 1 where a < b, for the comparison in expression e, and 0 elsewhere; during a step its input. */
kmp_ref kmp_tree_stated(const kmp_tree *tree, const kmp_expr *e, kmp_ref a, kmp_ref b);

/** abs(a), min(a, b) or max(a, b), for expression e. If the condition is constant during a step, the branch that its
 * input KMP_IN_MODE selects: 1 where a (a - b) is negative, -1 where it is not, 0 for the active one; of a bend 1 and
 * 0. */
kmp_ref kmp_tree_kink(const kmp_tree *tree, const kmp_expr *e, kmp_ref a, kmp_ref b);

/** Notes where exp, cosh, sinh or 1 - tanh^2 of a begins to count, for expression e of that function: a narrow pulse
 * between the places at which a step is evaluated would otherwise pass unseen. */
void kmp_tree_watch_pulse(const kmp_tree *tree, const kmp_expr *e, kmp_ref a);

/** A table of expression e at x. The knots of straight lines are kinks or bends, and so are the ends of a table that
 * holds its values there. One condition finds the knots of others, at which steps end. The ends of others are
 * conditions that end the run, or are reported. */
kmp_ref kmp_tree_table(const kmp_tree *tree, const kmp_expr *e, kmp_ref x);

/** 1 where `difference` is negative and 0 elsewhere; during a step an input KMP_IN_MODE in its place: for the laws of
 * forces and the rows of closures. `of` is the part of the model that has the condition (a kmp_force, kmp_closure,
 * kmp_wheel, ..), `number` distinguishes its conditions. Equal `of` and `number` give the same condition in any graph,
 * and the difference must be the same there. It depends on t, q and qd, and on other conditions. It changes where the
 * difference has passed zero by `lag`. `advice` is the remedy where it changes back and forth, within few lags each
 * time (NULL: the advice for laws of forces). The text describes the true condition, for the log: "wheel 'L':
 * contact in zone 2".
 *
 * Rows h of closures may switch by it to a branch of equal value; their J may jump there, and the rates with it. */
kmp_ref kmp_tree_condition(const kmp_tree *tree, const void *of, int number, kmp_ref difference, double lag,
                           const char *advice, const char *format, ...) __attribute__((format(printf, 7, 8)));

/** Steps end at the points of a table that a part of the model uses at x: a step over a short piece would not see it.
 * Tables of many points are left out. `of`, `number` and the text are as for kmp_tree_condition. */
void kmp_tree_watch_table(const kmp_tree *tree, const void *of, int number, const kmp_named_table *table, kmp_ref x,
                          const char *format, ...) __attribute__((format(printf, 6, 7)));

/** A run warns of such a condition, already made, where it holds; it is in the log where it holds at the start, too. */
void kmp_tree_warn_where_true(const kmp_tree *tree, const void *of, int number);

/** Runs end where `value` becomes negative, with the message: TEXT at t = .. s: ADVICE ("wheel 'L' left its rail", and
 * a possible cause or remedy; NULL: the model requests this end). `of` and `number` are as for kmp_tree_condition. The
 * value may depend on multipliers too (KMP_IN_LAMBDA), and on accelerations. It has no effect where conditions are
 * evaluated in place. */
void kmp_tree_end(const kmp_tree *tree, const void *of, int number, kmp_ref value, const char *advice,
                  const char *format, ...) __attribute__((format(printf, 6, 7)));

/** A table of two variables of expression e. */
kmp_ref kmp_tree_surface(const kmp_tree *tree, const kmp_expr *e, kmp_ref x, kmp_ref y);

/** The number of the condition that an end of a table (kmp_table_end) is passed. */
int kmp_table_end_number(const kmp_named_table *table, int end);

/** The quantity that is negative where condition k, `first < second`, is true: first - second. For a and b in `a < b`
 * and `a >= b` first is a, otherwise b. For an element, the value that its law or residual has noted in this graph;
 * false: none yet. */
bool kmp_tree_event(const kmp_tree *tree, int k, kmp_ref *difference);
