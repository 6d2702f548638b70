/* SPDX-License-Identifier: BSD-3-Clause */
/* A run of a model whose parts share nothing (model/data/islands.h), part by part: each has its own steps, so that an
 * event of one costs nothing in the others. The rows, the report and the log are the same as of one run. */
#pragma once

#include "integrators/run/run.h"

/** The parts of a system, each with its own system; NULL with KEMPE_OK: it is one, or the run needs it whole
 * (kmp_runs_as_whole). They are kept as long as the system lasts. */
struct kmp_island_systems;
kempe_status kmp_island_systems_of(const kempe_system *system, const kmp_run_spec *spec,
                                   const struct kmp_island_systems **parts);

/** The same for studies of states. The parts have the scales of the whole, by which their decisions are its own. */
kempe_status kmp_island_systems_of_states(const kempe_system *system, const struct kmp_island_systems **parts);

/** True if a run needs its system whole: for steps, dense output, a past, or coordinates chosen by the user. */
bool kmp_runs_as_whole(const kempe_system *system, const kmp_run_spec *spec);

/** The parts without some contacts (model/data/islands.h), for the caller to free. Systems that are the same are taken
 * from `earlier` parts, which then have them no longer; NULL: there are none. */
kempe_status kmp_island_systems_new(const kempe_system *system, const bool *left_out,
                                    struct kmp_island_systems *earlier, struct kmp_island_systems **parts);
void kmp_island_systems_free(struct kmp_island_systems *parts);

/** Their number, 0 where the model is one, and the system of a part; `motion`: by its coordinates, the ones of the
 * whole. */
int kmp_island_systems_count(const struct kmp_island_systems *parts);
const kempe_system *kmp_island_system(const struct kmp_island_systems *parts, int i, const int **motion);

/** By the closures of a part: the closures of the whole. */
const int *kmp_island_closures(const struct kmp_island_systems *parts, int i);

/** A run of one system, as kmp_run_whole makes. */
typedef kempe_status kmp_run_fn(const kempe_system *system, const kmp_run_spec *spec, const kempe_assembly *start,
                                kmp_row_fn *row, void *user, kmp_run_report *report);

/** kmp_run by parts, each of which `run` makes, from an assembled start. A run that fails or is interrupted has rows
 * until the first part did. */
kempe_status kmp_island_runs(const struct kmp_island_systems *parts, const kempe_system *system,
                             const kmp_run_spec *spec, const kempe_assembly *start, kmp_run_fn *run, kmp_row_fn *row,
                             void *user, kmp_run_report *report);

/** The report of a run to which the reports of others are added, all but its reason, its time and its energies. */
#define KMP_RUN_REPORT_NONE(end) ((kmp_run_report){.t = (end), .impacts = -1, .changes = -1, .prescribed = true})
void kmp_run_report_add(kmp_run_report *sum, const kmp_run_report *part);
