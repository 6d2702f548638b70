/* SPDX-License-Identifier: BSD-3-Clause */
/* A run of a model with many rigid contacts, most of which are far from touching at any time, piece by piece. Each
 * piece leaves out the contacts that its motion cannot reach: elements that only they connect move apart, as parts that
 * share nothing do (island_runs.h). */
#pragma once

#include "integrators/run/run.h"

/** True if a run has enough contacts for pieces to pay. */
bool kmp_near_may_pay(const kempe_system *system, const kmp_run_spec *spec);

/** kmp_run_whole in such pieces, where they pay; otherwise itself. A kmp_run_fn. */
kempe_status kmp_near_run(const kempe_system *system, const kmp_run_spec *spec, const kempe_assembly *start,
                          kmp_row_fn *row, void *user, kmp_run_report *report);
