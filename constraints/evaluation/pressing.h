/* SPDX-License-Identifier: BSD-3-Clause */
/* Forces that depend on multipliers: C(t, q, qd, lambda). At a state M qdd + C = J' lambda, J qdd + jdqd = 0 is then a
 * nonlinear system in the few multipliers nu of such forces (system->pressed). For C at given nu all else is linear,
 * and gives multipliers Lambda(nu). Newton's method solves nu = Lambda(nu) with the exact dC/dlambda. */
#ifndef KMP_CONSTRAINTS_EVALUATION_PRESSING_H
#define KMP_CONSTRAINTS_EVALUATION_PRESSING_H

#include "constraints/evaluation/plant.h"
#include "constraints/partition/partition.h"

/** Callback that solves for multipliers with the present factors of M and J. */
typedef struct kmp_answer {
    void *self;
    /** lambda (m) for C (n) and the plant's jdqd; `change`: for a small change of C alone, without jdqd. */
    void (*multipliers)(void *self, const double *bias, bool change, double *lambda);
} kmp_answer;

/** Solves for nu and updates the plant's bias, beginning with the last nu, which changes a unique solution only by
 * rounding. Without such forces it does nothing. false: Newton's method failed; kmp_put_unsettled has the message. */
bool kmp_press(kmp_plant *plant, const kmp_answer *answer);

/** Small changes near a state where C is at its multipliers. `factor` once, false if they are not determined; then
 * `change` adds to a change of C (n) at constant multipliers the part of their change. */
bool kmp_press_factor(kmp_plant *plant, const kmp_answer *answer);
void kmp_press_change(const kmp_plant *plant, const kmp_answer *answer, double *bias);

/** Restarts from nu = 0 the next time: C without load. */
void kmp_press_forget(kmp_plant *plant);

/** True if the last kmp_press has failed; the sentence that reports it. */
bool kmp_is_unsettled(const kmp_plant *plant);
void kmp_put_unsettled(const kmp_plant *plant, kmp_text *text);
kempe_status kmp_fail_unsettled(const kmp_plant *plant);

/** KEMPE_E_FAILED if a force depends on a multiplier that redundant rows leave undetermined, at the plant's last
 * closure. */
kempe_status kmp_pressing_check(kmp_plant *plant, const kmp_partition *part);

/** Marks in shared (m) the rows whose multipliers redundant rows leave undetermined at (t, q), a closed configuration;
 * count: their number. If Jv is singular none is marked. KEMPE_E_MEMORY. */
kempe_status kmp_find_shared(kmp_plant *plant, double t, const double *q, bool *shared, int *count);

/** Allocates the workspace of a plant. NULL: no memory. */
struct kmp_press_work *kmp_press_work_new(const kempe_system *system);
void kmp_press_work_free(struct kmp_press_work *work);

#endif
