/* SPDX-License-Identifier: BSD-3-Clause */
/* The conditions of an evaluator: which branch of piecewise laws and kinks holds, at a state or fixed. */
#pragma once

#include "backend/machine.h"
#include "base/arena.h"
#include "dynamics/system.h"

struct kmp_evaluator;

typedef struct kmp_present_conditions {
    kmp_machine *machine;    /* first - second of each; NULL: none are to be followed */
    double *mode;            /* the conditions (1 or 0), branches of kinks */
    int *late, late_count;   /* the conditions whose values depend on accelerations and multipliers */
    bool waits;              /* the machines of the evaluator do not have the present modes yet */
    bool frozen;             /* conditions are fixed; otherwise they follow the state */
    bool holds_friction;     /* inputs of friction that sticks do not follow the state (friction_state.h); rows of
                              * rigid contacts never do */
    const double *solved[2]; /* solutions of implicit blocks in conditions: of all conditions, and of late ones, since
                              * the last kmp_eval_all_changes */
} kmp_present_conditions;

/** `backend` NULL: none are followed. False: no memory. */
bool kmp_present_conditions_init(kmp_present_conditions *conditions, kmp_arena *arena, const kempe_system *system,
                                 const kmp_backend *backend);

/** Takes new inputs of an evaluation, NULL: the last values, and sets the conditions to that state, unless they are
 * fixed. Every evaluation does so first. */
void kmp_eval_follow_conditions(struct kmp_evaluator *eval, const double *t, const double *q, const double *qd);

/** first - second of each condition at (t, q, qd); NULL without conditions. A condition holds if this is negative. */
const double *kmp_eval_changes(struct kmp_evaluator *eval, double t, const double *q, const double *qd);

/** Evaluates all conditions into `change`, one value per condition, including conditions that depend on accelerations
 * and multipliers, which kmp_eval_changes gives as zero. */
void kmp_eval_all_changes(struct kmp_evaluator *eval, double t, const double *q, const double *qd, const double *qdd,
                          const double *lambda, double *change);

/** Puts the forces of all elements with modes, friction that sticks or slips and rigid contacts, in place of the
 * multipliers of their rows, where outputs and loads read them. `change`: as of kmp_eval_all_changes, whose values it
 * has then. */
void kmp_eval_show_friction(struct kmp_evaluator *eval, double t, const double *q, const double *qd, const double *qdd,
                            double *lambda, double *change);

/** Fixes the conditions as they are at (t, q, qd) for all later states, until kmp_eval_unfreeze. kmp_eval_set_mode
 * changes a fixed one. */
void kmp_eval_freeze(struct kmp_evaluator *eval, double t, const double *q, const double *qd);
void kmp_eval_unfreeze(struct kmp_evaluator *eval);
void kmp_eval_set_mode(struct kmp_evaluator *eval, int condition, bool holds);

/** Takes all conditions and branches of kinks from another time. */
void kmp_eval_set_modes(struct kmp_evaluator *eval, const double *mode);

/** Selects the branch of a kink (kmp_tree_kink); 0, initially: by the state. Not changed by kmp_eval_set_mode. Sets the
 * input of a friction element's role. */
void kmp_eval_set_kink(struct kmp_evaluator *eval, int condition, double side);
