/* SPDX-License-Identifier: BSD-3-Clause */
/* Kempe's own reference: runs near rounding on several formulations with several integrators. They share neither the
 * choice of coordinates nor the closing nor the formulas of a step. */
#pragma once

#include "studies/compare/compare_study.h"

/** Makes the comparison's own reference from several formulations and integrators, in at most `budget_s` of the
 * remaining time, at its own instants and at the times of a given reference (NULL: none). Without one, has_reference
 * stays false and `source` gives the reason. */
kempe_status kmp_compare_own_reference(kmp_compare_job *job, double budget_s, const kmp_reference *given);
