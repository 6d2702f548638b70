/* SPDX-License-Identifier: BSD-3-Clause */
/* Closures that see the coordinates through the vector d between their two points alone: balls, rods and whatever is
 * written so. Their h, J and jdqd can be had in several ways with the same values; the one with the fewest operations
 * is kept, closure by closure. */
#ifndef KMP_DYNAMICS_SHORTEN_POINT_GAP_H
#define KMP_DYNAMICS_SHORTEN_POINT_GAP_H

#include "dynamics/equations.h"

/** Exchanges rows of h, J, hdot and jdqd (those of `sets` that have been derived) where another way is shorter; with
 *  `search` the ways are looked for and written to eq->ways, else taken from there. false: no memory. */
bool kmp_gaps_shorten(kmp_equations *eq, unsigned sets, bool search);

#endif
