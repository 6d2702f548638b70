/* SPDX-License-Identifier: BSD-3-Clause */
/* An engine: the instances of one thread. Its pools stay from one chunk of a run to the next. */
#pragma once

#include "ensemble/lanes/ensemble_inside.h"

/** The pivots of Jv among the outputs of the last stage. */
const double *kmp_lanes_pivots(const kmp_engine *e, const kmp_lane_group *pool, const double *end);
/** An engine for a model with variable parameters; `apart`: with a separate context, below the context of the model. */
kempe_status kmp_engine_new(const kempe_model *model, int count, const char *const *names, bool apart,
                            kmp_engine **engine);
void kmp_engine_free(kmp_engine *engine);

/** Begins a run with a resolved spec and a given number of lanes, and ends it. */
kempe_status kmp_engine_begin(kmp_engine *engine, const kmp_run_spec *spec, const kmp_ensemble_execution *execution,
                              kmp_ensemble_done *all);
void kmp_engine_end(kmp_engine *engine);

/** Runs a chunk: `count` rows of values, their results, q and qd. */
kempe_status kmp_engine_run(kmp_engine *engine, int count, const double *values, kmp_ensemble_result *results,
                            double *q, double *qd);

/** Parts of it: room for the instances of a chunk, in its arena (false: no memory); all instances that wait in pools.
 */
bool kmp_engine_make_instances(kmp_engine *engine);
kempe_status kmp_engine_run_pools(kmp_engine *engine);

/** Keeps the constants of the system, and restores them. */
void kmp_constants_keep(const kempe_system *s, kmp_system_constants *constants);
void kmp_constants_take(kempe_system *s, const kmp_system_constants *constants);

/** Counts an instance that has come to its end. */
void kmp_engine_count(kmp_engine *engine);
