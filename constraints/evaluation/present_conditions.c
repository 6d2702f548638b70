/* SPDX-License-Identifier: BSD-3-Clause */
/* The conditions of piecewise laws: which branch holds at a state. The program of conditions gives first - second of
 * each one; a machine reads the branches as constants, so that its laws are smooth while a step is integrated.
 * Conditions may depend on conditions. Repeated passes set one level each, as signals in a circuit without loops
 * settle, and at most as many as there are conditions. */
#include "constraints/evaluation/present_conditions.h"
#include "constraints/evaluation/evaluator_inside.h"
#include "model/data/closure_table.h"
#include "model/data/force.h"
#include "model/data/model.h"
#include <string.h>

bool kmp_present_conditions_init(kmp_present_conditions *conditions, kmp_arena *arena, const kempe_system *system,
                                 const kmp_backend *backend)
{
    const int count = system->events.count;
    if (backend)
        conditions->machine = kmp_machine_new(system->changes, backend);
    if (!KMP_ARENA_MAKE(arena, KMP_ROOM(double, count, &conditions->mode),
                        KMP_ROOM(int, backend ? count : 0, &conditions->late)))
        return false;
    /* Late conditions have separate outputs, in their order. */
    for (int k = 0; backend && k < count; k++)
        if (system->events.condition[k].late)
            conditions->late[conditions->late_count++] = k;
    return conditions->machine || !backend;
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
    if (!eval->conditions.machine || eval->conditions.frozen)
        return;
    if (t)
        kmp_machine_set(eval->conditions.machine, KMP_IN_TIME, kmp_present_inputs_at(&eval->inputs, *t));
    if (q)
        kmp_machine_set(eval->conditions.machine, KMP_IN_Q, q);
    if (qd)
        kmp_machine_set(eval->conditions.machine, KMP_IN_QD, qd);
    /* Updates the conditions to the state. Conditions may depend on conditions: each pass settles one level. */
    int count = eval->system->events.count;
    for (int pass = 0; pass <= count; pass++) {
        bool same = true;
        const double *change = kmp_eval_run(eval, eval->conditions.machine, 1);
        for (int k = 0; k < count; k++) {
            const kmp_condition *condition = &eval->system->events.condition[k];
            bool held = condition->role != KMP_ROLE_NONE &&
                        (eval->conditions.holds_friction ||
                         ((const kmp_force *)condition->of)->kind == KMP_FORCE_TOUCH /* of a contact */);
            double mode = held ? eval->conditions.mode[k] : mode_at(condition, change + k);
            same = same && mode == eval->conditions.mode[k];
            eval->conditions.mode[k] = mode;
        }
        if (same)
            return;
        eval->conditions.waits = true;
    }
}

const double *kmp_eval_changes(kmp_evaluator *eval, double t, const double *q, const double *qd)
{
    if (!eval->conditions.machine)
        return NULL;
    kmp_machine_set(eval->conditions.machine, KMP_IN_TIME, kmp_present_inputs_at(&eval->inputs, t));
    kmp_machine_set(eval->conditions.machine, KMP_IN_Q, q);
    kmp_machine_set(eval->conditions.machine, KMP_IN_QD, qd);
    return kmp_eval_run(eval, eval->conditions.machine, 1);
}

void kmp_eval_all_changes(kmp_evaluator *eval, double t, const double *q, const double *qd, const double *qdd,
                          const double *lambda, double *change)
{
    const kmp_events *events = &eval->system->events;
    const double *now = kmp_eval_changes(eval, t, q, qd), *late = NULL;
    memcpy(change, now, (size_t)events->count * sizeof *change);
    if (eval->conditions.late_count > 0) {
        kmp_machine_set(eval->conditions.machine, KMP_IN_QDD, qdd);
        kmp_machine_set(eval->conditions.machine, KMP_IN_LAMBDA, lambda);
        late = kmp_eval_run(eval, eval->conditions.machine, 2);
    }
    for (int k = 0; k < eval->conditions.late_count; k++)
        change[eval->conditions.late[k]] = late[k];
    eval->conditions.solved[0] = now + events->count;
    eval->conditions.solved[1] = late ? late + eval->conditions.late_count : NULL;
}

/* Sets the entries of a closure's rows, which are in the order of the closures. */
static void set_rows_of(const kempe_system *s, int closure, double value, double *lambda)
{
    int low = 0, high = s->m;
    while (low < high) {
        const int middle = (low + high) / 2;
        if (s->rows[middle].closure < closure)
            low = middle + 1;
        else
            high = middle;
    }
    for (int r = low; r < s->m && s->rows[r].closure == closure; r++)
        lambda[r] = value;
}

void kmp_eval_show_friction(kmp_evaluator *eval, double t, const double *q, const double *qd, const double *qdd,
                            double *lambda, double *change)
{
    const kempe_system *s = eval->system;
    kmp_eval_all_changes(eval, t, q, qd, qdd, lambda, change);
    for (int k = 0; k < s->events.count; k++) {
        const kmp_condition *condition = &s->events.condition[k];
        if (condition->role == KMP_ROLE_GIVEN)
            set_rows_of(s, ((const kmp_force *)condition->of)->closure, change[k], lambda);
    }
}

void kmp_eval_freeze(kmp_evaluator *eval, double t, const double *q, const double *qd)
{
    kmp_eval_unfreeze(eval);
    kmp_eval_follow_conditions(eval, &t, q, qd);
    eval->conditions.frozen = true;
}

void kmp_eval_unfreeze(kmp_evaluator *eval)
{
    eval->conditions.frozen = false;
}

void kmp_eval_set_mode(kmp_evaluator *eval, int condition, bool holds)
{
    eval->conditions.mode[condition] = holds && !eval->system->events.condition[condition].kink ? 1 : 0;
    eval->conditions.waits = true;
}

void kmp_eval_set_modes(kmp_evaluator *eval, const double *mode)
{
    memmove(eval->conditions.mode, mode, (size_t)eval->system->events.count * sizeof *mode);
    eval->conditions.waits = true;
}

void kmp_eval_set_kink(kmp_evaluator *eval, int condition, double side)
{
    eval->conditions.mode[condition] = side;
    eval->conditions.waits = true;
}
