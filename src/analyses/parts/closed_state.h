/* SPDX-License-Identifier: BSD-3-Clause */
/* Loops at the state of an evaluator. */
#pragma once

#include "constraints/evaluation/evaluator.h"

/** Copies J of the last closure with the rows in `left_out` (m) zero, into room for all entries of J. */
void kmp_eval_mask(const kmp_evaluator *eval, const bool *left_out, double *masked);

/** True if every row, dropped ones included, is closed at the evaluator's last closure up to rounding of the model's
 * numbers. With only the kept rows a long step may reach another branch. */
bool kmp_rounding_closed(const kmp_evaluator *eval);
