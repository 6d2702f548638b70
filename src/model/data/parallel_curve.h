/* SPDX-License-Identifier: BSD-3-Clause */
/* The curve at a constant distance above a profile: what the centre of a sphere or roller on it follows. */
#pragma once

#include "symbolic/table_function.h"

/** A spline through places of that curve, several of each piece of the table; shared with the caller where the distance
 * is 0. NULL: no memory, or (*folds) the curve turns back because the profile is hollow with a smaller radius. */
kmp_table *kmp_parallel_curve(kmp_table *table, double distance, bool *folds);
