/* SPDX-License-Identifier: BSD-3-Clause */
/* Check of rows that are not solved for, for any formulation. */
#ifndef KMP_INTEGRATORS_FORMULATIONS_REDUNDANT_H
#define KMP_INTEGRATORS_FORMULATIONS_REDUNDANT_H

#include "constraints/evaluation/evaluator.h"
#include "constraints/partition/partition.h"

/** Checks that the dropped rows close, too, at the evaluator's last closure (at t): not wider than many tolerances
 * (scaled), nor than a multiple of the kept rows. KMP_GO, or KMP_HALT with the reason. */
int kmp_redundant_check(const kmp_evaluator *eval, const kmp_partition *part, double t, double tolerance,
                        kmp_text *reason);

#endif
