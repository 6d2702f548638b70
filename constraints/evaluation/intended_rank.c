/* SPDX-License-Identifier: BSD-3-Clause */
/* The intended rank of rounded closures, kept in the system once it is known, and tolerances that follow from it. */
#include "constraints/evaluation/intended_rank.h"
#include "constraints/evaluation/row_residuals.h"
#include "constraints/tolerances.h"
#include <math.h>

const kmp_rounding *kmp_rounding_of(const kempe_system *system)
{
    return system->rounding && atomic_load(&system->rounding->state) == KMP_ROUNDING_PRESENT ? system->rounding : NULL;
}

bool kmp_rounding_is_known(const kempe_system *system)
{
    return system->rounding && atomic_load(&system->rounding->state) >= KMP_ROUNDING_PRESENT;
}

void kmp_rounding_keep_none(const kempe_system *system)
{
    int none = KMP_ROUNDING_UNKNOWN;
    (void)atomic_compare_exchange_strong(&system->rounding->state, &none, KMP_ROUNDING_NONE);
}

bool kmp_rounding_closed(const kmp_evaluator *eval)
{
    int row;
    const kmp_rounding *rounding = kmp_rounding_of(eval->system);
    return kmp_eval_residual(eval) <= KMP_CLOSED_DROPPED &&
           kmp_eval_misfit(eval, &row) <= fmax(KMP_CLOSED_DROPPED, rounding ? rounding->tolerance : 0);
}

double kmp_rounding_zero(const kempe_system *system, double strict)
{
    const kmp_rounding *rounding = kmp_rounding_of(system);
    return rounding ? fmax(strict, rounding->zero) : strict;
}
