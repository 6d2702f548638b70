/* SPDX-License-Identifier: BSD-3-Clause */
/* Forces that depend on multipliers: C(t, q, qd, lambda). At a state M qdd + C = J' lambda, J qdd + jdqd = 0 is then a
 * nonlinear system in the few multipliers nu of such forces (system->load_rows). For C at given nu all else is linear,
 * and gives multipliers Lambda(nu). Newton's method solves nu = Lambda(nu) with the exact dC/dlambda. */
#pragma once

#include "constraints/evaluation/evaluator.h"

/** Callback that solves for multipliers with the present factors of M and J. */
typedef struct kmp_answer {
    void *self;
    /** lambda (m) for C (n) and the evaluator's jdqd; `change`: for a small change of only C, without jdqd. */
    void (*multipliers)(void *self, const double *bias, bool change, double *lambda);
} kmp_answer;

/** Solves for nu and updates the evaluator's bias, beginning with the last nu, which changes a unique solution only by
 * rounding. Without such forces it does nothing. false: Newton's method failed; kmp_put_unsettled has the message. */
bool kmp_load_settle(kmp_evaluator *eval, const kmp_answer *answer);

/** After kmp_load_settle: looks for another solution, from opposite, much larger and vanishing multipliers. *row: where
 * it differs most, *value: the other multiplier there. The evaluator keeps the first solution. */
bool kmp_load_find_other(kmp_evaluator *eval, const kmp_answer *answer, int *row, double *value);

/** Small changes near a state where C is at its multipliers. `factor` once, false if they are not determined; then
 * `change` adds to a change of C (n) at constant multipliers the part of their change. */
bool kmp_load_factor(kmp_evaluator *eval, const kmp_answer *answer);
void kmp_load_change(const kmp_evaluator *eval, const kmp_answer *answer, double *bias);

/** The same for changes of all multipliers (m) at constant loads, as of changed rows, too. false: there is nothing to
 * add. */
bool kmp_load_change_with(const kmp_evaluator *eval, const double *multipliers, double *bias);

/** The transpose of what `change` adds: weights on changes of C (n) as weights on multipliers at constant loads (m).
 * false: these are zero. */
bool kmp_load_change_back(const kmp_evaluator *eval, const double *bias, double *multipliers);

/** Restarts from nu = 0 the next time: C without load. */
void kmp_load_forget(kmp_evaluator *eval);

/** True if the last kmp_load_settle has failed; the sentence that reports it. */
bool kmp_is_unsettled(const kmp_evaluator *eval);
void kmp_put_unsettled(const kmp_evaluator *eval, kmp_text *text);
kempe_status kmp_fail_unsettled(const kmp_evaluator *eval);

/** Allocates the workspace of an evaluator in its arena. NULL: no memory. */
kmp_load_work *kmp_load_work_new(const kempe_system *system, kmp_arena *arena);
