/* SPDX-License-Identifier: BSD-3-Clause */
/* The largest and the least value of outputs over a cycle. */
#pragma once

#include "analyses/limit_cycles/cycle_branch.h"

/** Takes them from the rows of the last run of the flow, and where rows do not resolve an output from further runs with
 * rows near its corners and jumps. NaN: the output advances from period to period. KEMPE_E_MEMORY, KEMPE_STOPPED. */
kempe_status kmp_cycle_take_extremes(kmp_shooting *shooting, kmp_cycle *cycle);
