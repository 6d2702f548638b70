/* SPDX-License-Identifier: BSD-3-Clause */
/* Rows that share their load: redundant rows leave the multipliers of the rows that they depend on undetermined. */
#pragma once

#include "constraints/evaluation/evaluator.h"
#include "constraints/partition/partition.h"

/** KEMPE_E_FAILED if a force depends on a multiplier that redundant rows leave undetermined, at the evaluator's last
 * closure. */
kempe_status kmp_load_check(kmp_evaluator *eval, const kmp_partition *part);

/** Marks in shared (m) the rows whose multipliers redundant rows leave undetermined at (t, q), a closed configuration;
 * count: their number. If Jv is singular none is marked. KEMPE_E_MEMORY. */
kempe_status kmp_find_shared(kmp_evaluator *eval, double t, const double *q, bool *shared, int *count);
