/* SPDX-License-Identifier: BSD-3-Clause */
/* Conditions that a run warns of where they hold: a tyre beyond the range of its file. */
#pragma once

#include "base/text.h"
#include "dynamics/system.h"
#include "integrators/formulations/run_log.h"

/** Warns of each such condition that holds in a run by the log, and adds a line for each to the remarks. */
void kmp_remark_conditions(const kempe_system *system, const kmp_run_log *log, kmp_text *remarks);
