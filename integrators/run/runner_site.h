/* SPDX-License-Identifier: BSD-3-Clause */
/* A run that makes no steps. It stands at states of other motions of its system, as those of instances in lanes,
 * where impacts, modes and next values of states are decided as in a run. */
#pragma once

#include "integrators/run/run.h"

/** A memory has the samples, modes and impacts of a run, which it needs to continue beside its state, conditions and
 * inputs: its size in bytes, and a copy. */
size_t kmp_runner_memory_size(const kempe_system *system);
void kmp_runner_keep_memory(kmp_runner *runner, void *memory);

/** Makes one with the evaluator of the caller, which has the numbers and conditions of the present motion. */
kempe_status kmp_runner_site_new(kmp_evaluator *eval, const kmp_run_spec *spec, kmp_runner **site);
void kmp_runner_site_free(kmp_runner *site);

/** Takes the memory of any run of the system; `elsewhere`: for another state, at which modes and impacts begin as at a
 * start. */
void kmp_runner_take_memory(kmp_runner *run, const void *memory, bool elsewhere);
