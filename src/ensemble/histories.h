/* SPDX-License-Identifier: BSD-3-Clause */
/* Time histories of chosen instances of an ensemble: each is the table of a separate run, as `kempe simulate
 * --from` makes it. So its rows depend only on the instance, not on threads, parts or lanes. */
#pragma once

#include "ensemble/result_folder.h"

/** Reads numbers and ranges of instances, from 1 on: "3,10:12". NULL and "": none. KEMPE_E_ARGUMENT: other words, or
 * there is no such instance. */
kempe_status kmp_instance_ranges_read(kempe_context *context, kmp_arena *arena, const char *words, int instances,
                                      kmp_instance_ranges *ranges);

/** True if one of the instances first .. first + count - 1 is chosen. */
bool kmp_instance_ranges_meet(const kmp_instance_ranges *ranges, int first, int count);

/** The table "history" of the chosen ones of the instances first .. first + count - 1. KEMPE_STOPPED: interrupted. */
kempe_status kmp_histories(kempe_ensemble *ensemble, const kempe_run_options *run, const kmp_instance_ranges *ranges,
                           int first, int count, kempe_table **table);
