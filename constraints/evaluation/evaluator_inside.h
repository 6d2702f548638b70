/* SPDX-License-Identifier: BSD-3-Clause */
/* The machines of an evaluator, for its parts: their inputs and stages. */
#pragma once

#include "constraints/evaluation/evaluator.h"

/** Sets an input of all programs. */
void kmp_eval_set_all(kmp_evaluator *eval, kmp_input_kind kind, const double *values);

/** Runs a stage with the present modes. A decision sets many modes one after the other before an evaluation. */
static inline const double *kmp_eval_run(kmp_evaluator *eval, kmp_machine *machine, int stage)
{
    if (eval->conditions.waits)
        kmp_eval_set_all(eval, KMP_IN_MODE, eval->conditions.mode);
    eval->conditions.waits = false;
    return kmp_machine_run(machine, stage);
}
