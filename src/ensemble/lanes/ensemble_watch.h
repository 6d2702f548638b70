/* SPDX-License-Identifier: BSD-3-Clause */
/* Tests of the lanes at the end of their steps, as those of reduced.c, rank_margin.c and runner_change.c for one run.
 */
#pragma once

#include "ensemble/lanes/ensemble_inside.h"

/** Runs the last stage of a pool, and measures it. */
void kmp_lanes_watch(kmp_engine *e, kmp_lane_group *pool, kmp_lane_watched *x);

/** The pivots of Jv among the outputs of the last stage. */
const double *kmp_lanes_pivots(const kmp_engine *e, const kmp_lane_group *pool, const double *end);
/** True if the formulation accepts a step (accept of reduced.c): the closures corrected, the choice of u and the margin
 * good. */
bool kmp_lane_consents(kmp_engine *e, const kmp_lane_group *pool, kmp_lane_watched *x, size_t l);

/** True if another order of elimination is due. */
bool kmp_lane_order_is_bad(const kmp_engine *e, const kmp_lane_group *pool, const kmp_lane_watched *x, size_t l);

/** True if a run would step across a change point here (watch_margin of runner_change.c). */
bool kmp_instance_nears_change(kmp_instance *x, double t, double h, double margin);
