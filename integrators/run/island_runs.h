/* SPDX-License-Identifier: BSD-3-Clause */
/* A run of a model whose parts share nothing (model/data/islands.h), part by part: each has its own steps, so that an
 * event of one costs nothing in the others. The rows, the report and the log are the same as of one run. */
#pragma once

#include "integrators/run/run.h"

/** The parts of a system, each with its own system, kept as long as it lasts; NULL with KEMPE_OK: it is one, or the run
 * needs it whole: for steps, dense output, a past, or coordinates chosen by the user. */
struct kmp_island_systems;
kempe_status kmp_island_systems_of(const kempe_system *system, const kmp_run_spec *spec,
                                   const struct kmp_island_systems **parts);

/** kmp_run by parts, from an assembled start. A run that fails or is interrupted has rows until the first part did. */
kempe_status kmp_island_runs(const struct kmp_island_systems *parts, const kempe_system *system,
                             const kmp_run_spec *spec, const kempe_assembly *start, kmp_row_fn *row, void *user,
                             kmp_run_report *report);
