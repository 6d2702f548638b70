/* SPDX-License-Identifier: BSD-3-Clause */
/* Forces that depend on multipliers: C(t, q, qd, lambda). At a state M qdd + C = J' lambda, J qdd + jdqd = 0 is then a
 * nonlinear system in the few multipliers nu that forces depend on (system->pressed): with C at nu all else is linear,
 * and gives multipliers Lambda(nu). nu = Lambda(nu) is solved by Newton with the exact dC/dlambda. */
#ifndef KMP_CONSTRAINTS_EVALUATION_PRESSING_H
#define KMP_CONSTRAINTS_EVALUATION_PRESSING_H

#include "constraints/evaluation/plant.h"
#include "constraints/partition/partition.h"

/** What answers to C with the factors of M and J at hand. */
typedef struct kmp_answer {
    void *self;
    /** lambda (m) that belongs to C (n) and to the plant's jdqd; `change`: to C alone, without jdqd, as its small
     * changes have it. */
    void (*multipliers)(void *self, const double *bias, bool change, double *lambda);
} kmp_answer;

/** Brings the plant's bias to the multipliers that follow from it, beginning with the last ones, which do not matter
 *  beyond rounding where there is one solution; without such forces nothing happens. false: Newton has found none;
 *  kmp_put_unsettled has the sentence. */
bool kmp_press(kmp_plant *plant, const kmp_answer *answer);

/** Small changes beside a state where C is at its multipliers: `factor` once, false where they are not determined; then
 *  to a change of C (n) at constant multipliers, `change` adds what comes from theirs. */
bool kmp_press_factor(kmp_plant *plant, const kmp_answer *answer);
void kmp_press_change(const kmp_plant *plant, const kmp_answer *answer, double *bias);

/** Begins with zeros the next time: C is then that without load. */
void kmp_press_forget(kmp_plant *plant);

/** Whether the last kmp_press has failed, and the sentence that says so. */
bool kmp_is_unsettled(const kmp_plant *plant);
void kmp_put_unsettled(const kmp_plant *plant, kmp_text *text);
kempe_status kmp_fail_unsettled(const kmp_plant *plant);

/** KEMPE_E_FAILED when a force depends on a multiplier that redundant rows leave undetermined, at the plant's last
 *  closure. */
kempe_status kmp_pressing_check(kmp_plant *plant, const kmp_partition *part);

/** shared (m): the rows whose multipliers redundant rows leave open at (t, q), a closed configuration; count: how many.
 *  Where the rank is not that of the rows it says so of none. KEMPE_E_MEMORY. */
kempe_status kmp_find_shared(kmp_plant *plant, double t, const double *q, bool *shared, int *count);

/** What a plant keeps for it. NULL: no memory. */
struct kmp_press_work *kmp_press_work_new(const kempe_system *system);
void kmp_press_work_free(struct kmp_press_work *work);

#endif
