/* SPDX-License-Identifier: BSD-3-Clause */
/* The public workspace. Evaluation and accelerations are those of runs: by articulated bodies if that costs less, or
 * on the independent rows and coordinates of the start while these are good. */
#pragma once

#include "constraints/workspace/workspace_inside.h"

/** The inputs of a workspace. */
kmp_present_inputs *kmp_workspace_inputs(struct kempe_workspace *workspace);

/** Makes a workspace with friction that slips. KEMPE_E_MEMORY. */
kempe_status kmp_workspace_new(const kempe_system *system, kempe_workspace **workspace);

/** Lets friction decide on its modes at each state, and chooses rows there. KEMPE_E_MEMORY; the caller frees `friction`
 * then. */
kempe_status kmp_workspace_take_friction(kempe_workspace *ws, kmp_workspace_friction friction);

/** Reports a NULL argument; false: it is NULL. */
bool kmp_workspace_given(kempe_workspace *ws, const char *name, const void *argument);

/** Keeps the state of a call: `qd` may be NULL, and q and qd may be outputs of the caller. */
void kmp_workspace_keep_state(kempe_workspace *ws, double t, const double *q, const double *qd);

/** Copies the evaluator's values. */
void kmp_workspace_copy(kempe_workspace *ws);

/** Accelerations and multipliers from the evaluator's M, C, h, J and jdqd, as kempe_workspace_forward_dynamics. */
kempe_status kmp_workspace_accelerate(kempe_workspace *ws, const double *Q, double *qdd, double *lambda);
