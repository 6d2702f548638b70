/* SPDX-License-Identifier: BSD-3-Clause */
/* Closures that depend on the coordinates only through the vector d between their two points: balls, rods and similar
 * ones. Their h, J and jdqd have several variants with equal values; the one with the fewest operations is kept,
 * closure by closure. */
#pragma once

#include "dynamics/equations.h"

/** Replaces rows of h, J, hdot and jdqd (the ones of `sets` that have been derived) where another variant is shorter.
 * With `search` the variants are searched and written to eq->ways, otherwise taken from there. False: no memory. */
bool kmp_gaps_shorten(kmp_equations *eq, unsigned sets, bool search);
