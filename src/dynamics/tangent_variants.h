/* SPDX-License-Identifier: BSD-3-Clause */
/* The choice of the shorter derivation of the same matrices. */
#pragma once

#include "dynamics/tangents.h"

/** For an n x n matrix that is known to be symmetric: entries of the side with fewer operations replace those on the
 * other side of the diagonal, if there is a difference. Entries that are zero on one side become zero on the other.
 * False: no memory. */
bool kmp_tangents_mirror(const kmp_graph *g, int n, kmp_ref *matrix);

/** Chooses, from two derivations of each of two matrices (`count` entries; both NULL: not requested), those that
 * together with other outputs take the fewest operations. Entries that are zero in one derivation become zero in the
 * other. False: no memory. */
bool kmp_tangents_choose(const kmp_graph *g, int others, const kmp_ref *other, int count, kmp_ref *const by_q[2],
                         kmp_ref *const by_qd[2], kmp_tangent_choice *choice);
