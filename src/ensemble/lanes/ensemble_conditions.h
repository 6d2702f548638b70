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

/** Sets the conditions of an instance in the unknowns of a pool again, whose inputs have jumped at x->t, if some depend
 * on the time or on inputs. false: one ends the run there, or the state is not available. */
bool kmp_instance_renew_conditions(kmp_engine *e, kmp_lane_group *pool, int i);

/** True if some condition depends on accelerations or multipliers. */
bool kmp_has_late_conditions(const kempe_system *system);

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

/** Makes what an engine needs for them; false: no memory. */
bool kmp_within_init(kmp_engine *e);

/** Takes up a lane whose stages are all known. */
void kmp_within_begin(kmp_engine *e, kmp_lane_group *pool, size_t lane);
void kmp_within_end(kmp_engine *e);

/** The state at t within the step of that lane: q, qd, and, if `rates`, qdd and lambda. false: it is not available. */
bool kmp_within_state(kmp_engine *e, double t, bool rates, double *q, double *qd, double *qdd, double *lambda);

/** Accelerations and multipliers (NULL: not wanted) of a state of a pool, after kmp_instance_state. */
bool kmp_instance_complete(kmp_engine *e, kmp_lane_group *pool, const double *qd, double *qdd, double *lambda);

/** Gives the evaluator the inputs of a step; NULL: takes them back. */
void kmp_engine_hold_inputs(kmp_engine *e, const kmp_present_inputs *inputs);

/* Impacts, changes of modes and of closures, and samples of states happen to an instance between two of its steps.
 * It is at the site of its engine, a run that makes no steps, where all this is decided as in any run. */

/** Makes the site of an engine if its system needs one. */
kempe_status kmp_site_init(kmp_engine *e);

/** Begins the current instance at the site: e->site has the state, its accelerations and rows. KEMPE_E_FAILED: a run
 * would fail as well. */
kempe_status kmp_instance_restart(kmp_engine *e, kmp_instance *x, const kempe_assembly *a);

/** Passes the `event` that was looked at, or samples and jumps of inputs, of an instance in the unknowns of a pool, at
 * x->t, `since` the beginning of its step, and the closed state in e->state; the evaluator has its conditions and
 * inputs. Then puts it into a pool, or leaves it to a separate run. */
kempe_status kmp_instance_pass(kmp_engine *e, kmp_lane_group *from, int i, bool event, double since);

/** The same of samples and jumps of inputs, from x->y. */
kempe_status kmp_instance_meet(kmp_engine *e, kmp_lane_group *from, int i);
