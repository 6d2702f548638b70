/* SPDX-License-Identifier: BSD-3-Clause */
/* The conditions of piecewise laws: which branch holds at a state. The program of conditions gives first - second of
 * each one; a machine reads the branches as constants, so that its laws are smooth while a step is integrated.
 * Conditions may depend on conditions. Repeated passes set one level each, as signals in a circuit without loops
 * settle, and at most as many as there are conditions. */
#include "constraints/evaluation/condition_modes.h"
#include "model/data/model.h"
#include <string.h>

static void set_modes(kmp_evaluator *eval)
{
    kmp_eval_set_all(eval, KMP_IN_MODE, eval->mode);
}

/* The mode of a condition at its value. Friction slips by the sign of its rate. */
static double mode_at(const kmp_condition *condition, const double *change)
{
    double rate = condition->role == KMP_ROLE_SENSE ? change[KMP_ROLE_RATE - KMP_ROLE_SENSE] : 0;
    if (condition->role != KMP_ROLE_NONE)
        return (rate > 0) - (rate < 0);
    return *change < 0 && !condition->ends && !condition->kink ? 1 : 0;
}

void kmp_eval_follow_conditions(kmp_evaluator *eval, const double *t, const double *q, const double *qd)
{
    if (!eval->changes || eval->frozen)
        return;
    if (t)
        kmp_machine_set(eval->changes, KMP_IN_TIME, kmp_present_inputs_at(&eval->inputs, *t));
    if (q)
        kmp_machine_set(eval->changes, KMP_IN_Q, q);
    if (qd)
        kmp_machine_set(eval->changes, KMP_IN_QD, qd);
    /* Updates the conditions to the state. Conditions may depend on conditions: each pass settles one level. */
    int count = eval->system->events.count;
    for (int pass = 0; pass <= count; pass++) {
        bool same = true;
        const double *change = kmp_machine_run(eval->changes, 1);
        for (int k = 0; k < count; k++) {
            const kmp_condition *condition = &eval->system->events.condition[k];
            bool held = condition->role != KMP_ROLE_NONE &&
                        (eval->holds_friction ||
                         ((const kmp_force *)condition->of)->kind == KMP_FORCE_TOUCH /* of a contact */);
            double mode = held ? eval->mode[k] : mode_at(condition, change + k);
            same = same && mode == eval->mode[k];
            eval->mode[k] = mode;
        }
        if (same)
            return;
        set_modes(eval);
    }
}

const double *kmp_eval_changes(kmp_evaluator *eval, double t, const double *q, const double *qd)
{
    if (!eval->changes)
        return NULL;
    kmp_machine_set(eval->changes, KMP_IN_TIME, kmp_present_inputs_at(&eval->inputs, t));
    kmp_machine_set(eval->changes, KMP_IN_Q, q);
    kmp_machine_set(eval->changes, KMP_IN_QD, qd);
    return kmp_machine_run(eval->changes, 1);
}

void kmp_eval_all_changes(kmp_evaluator *eval, double t, const double *q, const double *qd, const double *qdd,
                          const double *lambda, double *change)
{
    const kmp_events *events = &eval->system->events;
    const double *now = kmp_eval_changes(eval, t, q, qd), *late = NULL;
    for (int k = 0; k < events->count; k++)
        change[k] = now[k];
    for (int k = 0; k < events->count; k++) {
        if (!events->condition[k].late)
            continue;
        if (!late) {
            kmp_machine_set(eval->changes, KMP_IN_QDD, qdd);
            kmp_machine_set(eval->changes, KMP_IN_LAMBDA, lambda);
            late = kmp_machine_run(eval->changes, 2);
        }
        change[k] = *late++;
    }
    eval->solved[0] = now + events->count;
    eval->solved[1] = late;
}

void kmp_eval_freeze(kmp_evaluator *eval, double t, const double *q, const double *qd)
{
    eval->frozen = false;
    kmp_eval_follow_conditions(eval, &t, q, qd);
    eval->frozen = true;
}

void kmp_eval_set_mode(kmp_evaluator *eval, int condition, bool holds)
{
    eval->mode[condition] = holds && !eval->system->events.condition[condition].kink ? 1 : 0;
    set_modes(eval);
}

void kmp_eval_set_modes(kmp_evaluator *eval, const double *mode)
{
    memmove(eval->mode, mode, (size_t)eval->system->events.count * sizeof *mode);
    set_modes(eval);
}

void kmp_eval_set_kink(kmp_evaluator *eval, int condition, double side)
{
    eval->mode[condition] = side;
    set_modes(eval);
}
