/* SPDX-License-Identifier: BSD-3-Clause */
/* Conditions of piecewise laws and branches of kinks, at a state or fixed. */
#pragma once

#include "constraints/evaluation/evaluator.h"

/** first - second of each condition at (t, q, qd); NULL without conditions. A condition holds if this is negative. */
const double *kmp_eval_changes(kmp_evaluator *eval, double t, const double *q, const double *qd);

/** Evaluates all conditions into `change`, one value per condition, including those that depend on accelerations and
 * multipliers, which kmp_eval_changes gives as zero. */
void kmp_eval_all_changes(kmp_evaluator *eval, double t, const double *q, const double *qd, const double *qdd,
                          const double *lambda, double *change);

/** Takes new inputs of an evaluation, NULL: the last values, and sets the conditions to that state, unless they are
 * fixed. Every evaluation does so first. */
void kmp_eval_follow_conditions(kmp_evaluator *eval, const double *t, const double *q, const double *qd);

/** Fixes the conditions as they are at (t, q, qd) for all later states, until `frozen` is cleared. kmp_eval_set_mode
 * changes a fixed one. */
void kmp_eval_freeze(kmp_evaluator *eval, double t, const double *q, const double *qd);
void kmp_eval_set_mode(kmp_evaluator *eval, int condition, bool holds);

/** Takes all conditions and branches of kinks from another time. */
void kmp_eval_set_modes(kmp_evaluator *eval, const double *mode);

/** Selects the branch of a kink (kmp_tree_kink); 0, initially: by the state. Not changed by kmp_eval_set_mode. Sets the
 * input of a friction element's role. */
void kmp_eval_set_kink(kmp_evaluator *eval, int condition, double side);
