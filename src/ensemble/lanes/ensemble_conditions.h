/* SPDX-License-Identifier: BSD-3-Clause */
/* Conditions of instances in lanes. Their values at both ends of a step are evaluated in all lanes together, and
 * bounds between them decide most steps. */
#pragma once

#include "ensemble/lanes/ensemble_inside.h"

/** Reason why lanes cannot watch the conditions of a system; NULL: they can. */
const char *kmp_conditions_no_lanes(const kempe_system *system);

/** Makes what an engine needs for them; false: no memory. */
bool kmp_conditions_init(kmp_engine *e);

/** Sets the conditions of the current instance by its start. false: one ends the run there. */
bool kmp_instance_begin_conditions(kmp_engine *e, kmp_instance *x, const double *q, const double *qd);

/** The crossing for the current instance; NULL: there are no conditions. */
kmp_event_tracker *kmp_instance_crossing(kmp_engine *e, kmp_instance *x);

/** True if some condition depends on accelerations or multipliers. */
bool kmp_has_late_conditions(const kempe_system *system);

/** Keeps the evaluator's conditions as those of the current instance. */
void kmp_instance_keep_modes(const kmp_engine *e, kmp_instance *x);

/** The watch of the conditions of a lane; NULL: there are none. */
kmp_event_tracker *kmp_lane_watching(const kmp_engine *e, size_t lane);

/** Takes the lane of kmp_within_begin to its event: the instance then has the time and the work there, e->state the
 * closed state. `pass`: the conditions change, and the instance has them; false: they change without end. Otherwise the
 * state is that before they change; false: it is not available. */
bool kmp_lane_visit_event(kmp_engine *e, double t, bool pass);

/** Finds the accepted steps within which conditions change; `searched`: lanes whose stages of the dense output are
 * counted. Returns true if these stages are known. */
bool kmp_taken_watch(kmp_engine *e, kmp_lane_group *pool, const kmp_lane_watched *seen, kmp_attempt *what,
                     bool *searched);
