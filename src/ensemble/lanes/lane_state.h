/* SPDX-License-Identifier: BSD-3-Clause */
/* Attempts of steps in the lanes of a pool (ensemble_engine.c), with what they need: the lanes' numbers and evaluations
 * (lane_state.c), and events and quantities within accepted steps. */
#pragma once

#include "ensemble/lanes/ensemble_inside.h"

/* Pools are found by the inputs of their program, so that an instance runs in the same pool whatever the other
 * instances are. */

/** Finds the pool of a partition; Jv at the evaluator's last closure determines the order of elimination. NULL in
 * *pool: its program cannot be written. */
kempe_status kmp_lane_group_find(kmp_engine *e, const kmp_partition *part, kmp_lane_group **pool);
/** The first pool of a partition in any order of elimination; NULL: there is none. */
kmp_lane_group *kmp_lane_group_of_choice(kmp_engine *e, const kmp_partition *part);
/** True if a pool has the only order of elimination of its partition. */
bool kmp_lane_group_is_ordered(const kmp_lane_group *pool);
void kmp_lane_group_free(kmp_lane_group *pool);
/** True if an engine has a pool of the same choice and order. */
bool kmp_lane_group_among(const kmp_engine *e, const kmp_lane_group *pool);
void kmp_lane_group_put(kmp_engine *e, kmp_lane_group *pool, int i);
int kmp_lane_group_take(kmp_engine *e, kmp_lane_group *pool);

/** Sets the times of evaluations to a part c of each lane's step; puts the inputs of each lane at its time. */
void kmp_room_set_times(kmp_lane_state *room, double c);
void kmp_room_put_inputs(kmp_engine *e);

/** Finds the time that the next steps of a lane do not go beyond: the end of the run, the next jump of an input, or the
 * next sample of a state. */
void kmp_room_find_limit(kmp_engine *e, size_t lane);

/** k = f(at, y) in all lanes; failed evaluations are marked in `bad`. */
void kmp_room_evaluate(kmp_engine *e, kmp_lane_group *pool, const double *y, double *k);

/** The stages of an attempt; the stages of the dense output, whose failures go to `dense_bad`. */
void kmp_room_run_stages(kmp_engine *e, kmp_lane_group *pool);
void kmp_room_run_dense_stages(kmp_engine *e, kmp_lane_group *pool);

/** Accelerations of v from the slopes and the values of the last stage there: Bvu udd and the part that does not depend
 * on udd. Then, after n numbers, the multipliers where conditions need them; dropped rows have none. */
void kmp_room_find_accelerations(const kmp_engine *e, const kmp_lane_group *pool, const double *end,
                                 const double *slope, double *vdd);

/** Copies an instance to a lane, and the state of a lane to its instance; empties a lane. */
void kmp_room_load(kmp_engine *e, kmp_lane_group *pool, size_t lane, int instance);
void kmp_room_store(kmp_engine *e, size_t lane);
void kmp_room_empty(kmp_lane_state *room, size_t lane);

/** Takes the steps of a lane that needed no decision into the account of its instance; the next one needs one. */
void kmp_room_count_made(kmp_engine *e, size_t lane);

/** Leaves the instance of a lane to a separate run, from its last accepted step on; runs their parts. */
void kmp_lane_evict(kmp_engine *e, size_t lane, const char *why);
kempe_status kmp_room_run_expelled(kmp_engine *e, kmp_lane_group *pool);

/** Computes slopes, signs and first steps of new lanes. */
void kmp_room_begin(kmp_engine *e, kmp_lane_group *pool);

/** Gives the programs of a lane the conditions of its instance. */
void kmp_lane_set_modes(kmp_engine *e, kmp_lane_group *pool, size_t lane);

/** Makes the lanes of an engine, in the arena of its run. false: no memory. */
bool kmp_lane_state_init(kmp_engine *e, int width);
