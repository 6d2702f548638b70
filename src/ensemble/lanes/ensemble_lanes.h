/* SPDX-License-Identifier: BSD-3-Clause */
/* DOP853 on the lanes of a pool: an attempt of a step in every lane, then for each lane the decisions of rk.c and
 * reduced.c. Lanes of instances that have finished, or that another pool continues, are filled again. */
#pragma once

#include "ensemble/lanes/ensemble_inside.h"

/** Runs a pool until it is empty, or until another has more to do. */
kempe_status kmp_lane_group_run(kmp_engine *e, kmp_lane_group *pool);
