/* SPDX-License-Identifier: BSD-3-Clause */
/* Delayed signals of a run. Their past is recorded from the dense output of the integrator: polynomials of its order
 * or a higher one, split until their last coefficients are far below the tolerance. A step ends where the part of the
 * past that it needs ends: at the delay after each event and each jump of a derivative, which propagate with an order
 * higher by one, and at most the delay after its own start. So no step needs values of itself. */
#pragma once

#include "integrators/run/runner.h"

typedef struct kmp_delays kmp_delays;

/** Begins the past of the delayed signals, and sets their states in run->room.state, which has the start of the run at
 * t.
 */
kempe_status kmp_delays_begin(kmp_runner *run, double t);
void kmp_delays_free(kmp_runner *run);

/** Records the last step up to t, which completes the past. */
kempe_status kmp_delays_record(kmp_runner *run, double t);

/** Notes that derivatives of this order and higher ones of all signals may jump at the end of the past. */
void kmp_delays_jump(kmp_runner *run, int order);

/** Notes the jumps that follow from jumps of inputs and other delayed signals at t. */
void kmp_delays_follow(kmp_runner *run, double t);

/** Sets the states of delays in run->room.state whose signals or derivatives jump at t. Others keep their values: an
 * event of theirs would have passed again. */
void kmp_delays_take(kmp_runner *run, double t);
