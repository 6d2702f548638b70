/* SPDX-License-Identifier: BSD-3-Clause */
/* Doubts of a result by a state. */
#pragma once

#include "constraints/evaluation/evaluator.h"

/** Doubts a state of a result, each time once: by conditions that end runs, and by tables that are used beyond their
 * points: in closures, where `forces` in laws, and, with the values of kmp_eval_shown there (NULL: not), in outputs;
 * where `rates` by rotations of flexible bodies, which runs judge along their way. */
void kmp_eval_doubt_state(kmp_evaluator *eval, double t, const double *q, const double *qd, const double *qdd,
                          const double *lambda, bool forces, bool rates, const double *shown);
