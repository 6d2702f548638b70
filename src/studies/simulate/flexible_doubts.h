/* SPDX-License-Identifier: BSD-3-Clause */
/* Doubts about flexible bodies that the rows of a run show. */
#pragma once

#include "constraints/evaluation/evaluator.h"
#include "output/samples.h"

/** Doubts states at which bodies deflect beyond what the terms of second order are right for: `count` of them, each of
 * which `q` gives. */
void kmp_doubt_deflections(const kempe_system *system, int count, const double *q(const void *user, int k),
                           const void *user);

/** The same of one state. */
void kmp_doubt_deflection(const kempe_system *system, const double *q);

/** Logs them: loads of sections that differ from the loads by the strain, fast rotations without terms of second order,
 * and loads at which a body buckles, are warnings. KEMPE_E_MEMORY. */
kempe_status kmp_doubt_flexible(const kmp_samples *table, kmp_evaluator *eval);
