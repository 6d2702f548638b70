/* SPDX-License-Identifier: BSD-3-Clause */
/* The pipeline for studies that simulate on their way. */
#pragma once

#include "studies/simulate/trajectory.h"

/** kempe_simulate as a part of another computation, which continues and judges itself: KEMPE_OK also where the run
 * cannot be trusted. Its warnings belong to the whole. */
kempe_status kmp_simulate(const kempe_system *system, const kempe_run_options *run, kempe_trajectory **trajectory);
