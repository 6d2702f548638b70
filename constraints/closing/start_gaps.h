/* SPDX-License-Identifier: BSD-3-Clause */
/* Contacts whose gap counts from the start as it is written: of ropes without a length, of teeth with play. */
#pragma once

#include "base/text.h"
#include "constraints/evaluation/evaluator.h"

/** True if the model has such contacts. */
bool kmp_has_start_gaps(const kempe_system *system);

/** The number of these whose gap differs between the start as it is written and the closed one, q: their preload, slack
 * or play is not what the model says of the start. -1: no memory. `text` (NULL: none): a sentence of each, with its
 * line end. */
int kmp_count_start_gaps(kmp_evaluator *eval, const double *q, kmp_text *text);

/** The sentences, by a separate evaluator. False: no memory. */
bool kmp_put_start_gaps(kmp_text *text, const kempe_system *system, const double *q);
