/* SPDX-License-Identifier: BSD-3-Clause */
#include "analyses/parts/closed_state.h"
#include "constraints/evaluation/intended_rank.h"
#include "constraints/tolerances.h"
#include <math.h>

void kmp_eval_mask(const kmp_evaluator *eval, const bool *left_out, double *masked)
{
    const kmp_pattern *j = &eval->system->jacobian;
    for (int e = 0; e < j->count; e++)
        masked[e] = left_out[j->row[e]] ? 0 : eval->jacobian[e];
}

bool kmp_rounding_closed(const kmp_evaluator *eval)
{
    int row;
    const kmp_rounding *rounding = kmp_rounding_of(eval->system);
    return kmp_eval_residual(eval) <= KMP_CLOSED_DROPPED &&
           kmp_eval_misfit(eval, &row) <= fmax(KMP_CLOSED_DROPPED, rounding ? rounding->tolerance : 0);
}
