/* SPDX-License-Identifier: BSD-3-Clause */
/* The earliest event of a step of a run (integrators/events/event_pieces.h). Bounds use cubics for the coordinates,
 * through their values and rates at both ends of the piece. */
#pragma once

#include "integrators/run/events.h"

/** True if a step had changes that bounds could not exclude within the bound of work, with a sentence that names the
 * first condition. The result is not trustworthy. */
bool kmp_event_tracker_is_undecided(const kmp_event_tracker *tracker, kmp_text *why);

/** Finds the earliest event of the step between two times. *t is its time, just beyond the change; unchanged if there
 * is none. */
kempe_status kmp_event_tracker_find(kmp_event_tracker *tracker, double from, double to, double *t, bool *found);

/** True if the values at the ends of a step, and in its middle if that is given, decide that no condition changes
 * within it; the tracker then takes them into account, as kmp_event_tracker_find does. Their `solved` may be NULL
 * where no condition has an implicit block, and no kink is to be fixed. */
bool kmp_event_tracker_is_clear(kmp_event_tracker *tracker, const kmp_event_probe *from, const kmp_event_probe *middle,
                                const kmp_event_probe *to);

/** Fixes the free kinks that the step of the last kmp_event_tracker_find has passed, on the side where it began, so
 * that the step can be made again up to the kink. False: there are none. */
bool kmp_event_tracker_hold_passed(kmp_event_tracker *tracker);

/** Watches the motion of another instance of the mechanism: its conditions, parameters, inputs and pasts. To
 * find and pass events, the evaluator must have the same. */
void kmp_event_tracker_take(kmp_event_tracker *tracker, const double *mode, const double *parameters,
                            const kmp_present_inputs *inputs, kmp_condition_past *past);

/** Allocates a search in the arena; false: no memory. */
bool kmp_event_search_init(kmp_event_search *search, const kempe_system *system, bool closely, kmp_arena *arena);
