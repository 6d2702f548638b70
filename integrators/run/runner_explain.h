/* SPDX-License-Identifier: BSD-3-Clause */
/* Reason of a run's end, as a sentence. */
#pragma once

#include "integrators/run/run.h"

/** Turns KEMPE_E_FAILED into run->reason, `otherwise` without a known reason; KEMPE_STOPPED when the mechanism locks.
 * Other statuses pass. */
kempe_status kmp_runner_give_up(kmp_runner *run, kempe_status status, const char *otherwise, double t);

/** Fails without multipliers at a state: reports the condition that ends runs there, if there is one, or the force. */
kempe_status kmp_runner_fail_unsettled(kmp_runner *run, double t, const double *q, const double *qd);

/** Appends the sentence of a lock, the formulation, the integrator, or `otherwise`. True for a lock. */
bool kmp_runner_reason(kmp_runner *run, const char *otherwise, double t, kmp_text *text);

/** Appends to a reason the spherical joint with nearly singular angles at the last step, and the coordinate whose
 * rounding is above the tolerance there, if there is one. */
void kmp_runner_explain_position(kmp_runner *run, kmp_text *text);

/** Appends the flexible body by which M is hardly positive at the last step, if there is one. */
void kmp_runner_explain_inertia(kmp_runner *run, kmp_text *text);

/** The row of a prescribed motion that cannot continue beyond the last step's end, a dead centre; -1: none. */
int kmp_runner_lock(kmp_runner *run, double t);

/** The coordinate that a row prescribes by itself, NULL for several. */
const char *kmp_runner_driven_by(const kempe_system *s, int row);
