/* SPDX-License-Identifier: BSD-3-Clause */
/* Tables that a state of a study leaves. */
#pragma once

#include "constraints/evaluation/evaluator.h"

/** Doubts tables that are used beyond their points at a state of a result, each once: in closures, where `forces` in
 * laws, and, with the values of kmp_eval_shown there (NULL: not), in outputs. */
void kmp_eval_tell_tables(kmp_evaluator *eval, double t, const double *q, const double *qd, const double *qdd,
                          const double *lambda, bool forces, const double *shown);
