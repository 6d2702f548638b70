/* SPDX-License-Identifier: BSD-3-Clause */
#pragma once

#include "studies/compare/compare_study.h"

/** Runs a method once, stopped after limit_s; its time is subtracted from the rest. The rows replace the rows of
 * `table`. The caller frees report->reason. */
kempe_status kmp_compare_once(kmp_compare_job *job, const kmp_method *method, double rtol, const kmp_times *times,
                              double limit_s, kmp_samples *table, kmp_run_report *report);

/** Determines by a few coarse runs if the model is stiff. */
kempe_status kmp_compare_probe(kmp_compare_job *job, bool *stiff);

/** Runs all methods at all tolerances, from coarse ones to fine ones. */
kempe_status kmp_compare_run_all(kmp_compare_job *job);

bool kmp_steps_are_stiff(long loose, long tight, double decades, long implicit);
kmp_stiffness kmp_compare_stiffness(const kempe_comparison *comparison);
