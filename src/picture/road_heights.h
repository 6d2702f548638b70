/* SPDX-License-Identifier: BSD-3-Clause */
/* Heights of a road, for its picture. */
#pragma once

#include "model/data/tyre.h"
#include <kempe/kempe.h>

/** The heights at places along a road whose height is an expression, m; with t = 0 where it depends on t. False: no
 * memory, or a height that depends on more than x and t. */
bool kmp_road_heights(const kempe_model *model, const kmp_road *road, int count, const double *x, double *height);
