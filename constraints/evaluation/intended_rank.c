/* SPDX-License-Identifier: BSD-3-Clause */
/* The intended rank of rounded closures, kept in the system once it is known, and tolerances that follow from it. */
#include "constraints/evaluation/intended_rank.h"
#include <math.h>
#include <stdatomic.h>

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

double kmp_rounding_zero(const kempe_system *system, double strict)
{
    const kmp_rounding *rounding = kmp_rounding_of(system);
    return rounding ? fmax(strict, rounding->zero) : strict;
}
