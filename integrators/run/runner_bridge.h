/* SPDX-License-Identifier: BSD-3-Clause */
/* A row within the last step that its formulation cannot complete: inside a step its u, or the rows it keeps, may be
 * singular although they are good at both ends. */
#pragma once

#include "integrators/run/run.h"

/** Computes the row at t within the last step by another formulation after its own has failed, and notes it in the
 * log; arguments as for kmp_runner_inner_row. false: not available, and nothing is changed. */
bool kmp_runner_bridge(kmp_runner *run, double t, double *row, double *work);
