/* SPDX-License-Identifier: BSD-3-Clause */
/* Impacts, changes of modes and of closures, and samples of states happen to an instance between two of its steps.
 * It stands at the site of its engine, a run that makes no steps, where all this is decided as in any run. */
#pragma once

#include "ensemble/lanes/ensemble_inside.h"

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
