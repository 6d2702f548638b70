/* SPDX-License-Identifier: BSD-3-Clause */
/* States within the present step of a lane: those of its interpolant, on closed loops. */
#pragma once

#include "ensemble/lanes/ensemble_inside.h"

/** Makes what an engine needs for them; false: no memory. */
bool kmp_within_init(kmp_engine *e);

/** Takes up a lane whose stages are all known. kmp_within_is_exact: false if its interpolant is less exact than the
 * step, where a run would integrate anew. */
void kmp_within_begin(kmp_engine *e, kmp_lane_group *pool, size_t lane);
bool kmp_within_is_exact(kmp_engine *e);

/** Makes the instance of that lane the current one with the inputs of its step, if it is not; then takes these back. */
void kmp_within_stand(kmp_engine *e);
void kmp_within_end(kmp_engine *e);

/** The state at t within the step of that lane: q, qd, and, if `rates`, qdd and lambda. false: it is not available. */
bool kmp_within_state(kmp_engine *e, double t, bool rates, double *q, double *qd, double *qdd, double *lambda);

/** Accelerations and multipliers (NULL: not wanted) of a state of a pool, after kmp_instance_state. */
bool kmp_instance_complete(kmp_engine *e, kmp_lane_group *pool, const double *qd, double *qdd, double *lambda);

/** Gives the evaluator the inputs of a step; NULL: takes them back. */
void kmp_engine_hold_inputs(kmp_engine *e, const kmp_present_inputs *inputs);
