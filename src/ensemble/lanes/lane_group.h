/* SPDX-License-Identifier: BSD-3-Clause */
/* Pools are found by the inputs of their program, so that an instance runs in the same pool whatever the other
 * instances are. */
#pragma once

#include "ensemble/lanes/ensemble_inside.h"

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
