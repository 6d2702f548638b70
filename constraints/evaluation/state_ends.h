/* SPDX-License-Identifier: BSD-3-Clause */
/* Conditions at a state of a study: ends of runs, as laws and closures are not meant beyond them, and the side
 * that a row has. */
#pragma once

#include "base/text.h"
#include "constraints/evaluation/evaluator.h"

/** The conditions by which a state is judged. */
typedef enum kmp_ends_judged {
    KMP_ENDS_OF_PLACES, /* of closures, ropes, outlines and wheels, without forces and their tables */
    KMP_ENDS_OF_MODEL,  /* with forces */
    KMP_ENDS_OF_RUN     /* with 'until', which the user asks of a run */
} kmp_ends_judged;

/** The next condition from *from on that ends runs and is broken at a state; *from becomes the one after it. -1: none.
 * `qdd` NULL: without conditions that depend on accelerations and multipliers. */
int kmp_eval_next_end(kmp_evaluator *eval, kmp_ends_judged judged, double t, const double *q, const double *qd,
                      const double *qdd, const double *lambda, int *from);

/** The time at which a row at t has its forces, as rows of runs have them: just before t where a condition changes
 * there as time passes, t otherwise and at the start. Inputs have their own side (kmp_present_inputs). */
double kmp_eval_row_time(kmp_evaluator *eval, double t, const double *q, const double *qd);

/** True if an expression of the model is a part of a closure, also under a name. */
bool kmp_is_in_closures(const kempe_model *model, const kmp_expr *part);

/** "rope 's' has turned by 3.1 rad about 'ground.O' since the start at t = 2 s: " and its advice. */
void kmp_put_end(kmp_text *text, const kempe_system *system, int condition, double t);

/** The doubt of a result at a state at which a run would end. */
#define KMP_RUN_WOULD_END "a run would end at this state, where its equations hold no longer: %s"

/** Doubts a state of a result by each condition that it breaks, once for an evaluator. */
void kmp_eval_doubt_ends(kmp_evaluator *eval, kmp_ends_judged judged, double t, const double *q, const double *qd,
                         const double *qdd, const double *lambda);

/** The workspace of an evaluator, in its arena. NULL: no memory. */
kmp_state_ends *kmp_state_ends_new(const kempe_system *system, kmp_arena *arena);
