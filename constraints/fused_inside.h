/* SPDX-License-Identifier: BSD-3-Clause */
/* The program of fused.c, which fused_write.c makes. */
#ifndef KMP_CONSTRAINTS_FUSED_INSIDE_H
#define KMP_CONSTRAINTS_FUSED_INSIDE_H

#include "constraints/reduction.h"

enum { KMP_FUSED_FREEDOMS = 8, KMP_FUSED_BLOCK = 24 }; /* at most: independent coordinates, rows of a block of Jv */

/* Stages: qd of v from (t, q) and qd of u; udd, then the pivots of the reduced mass, from all qd and the user's efforts
 * (KMP_IN_EFFORT); the multipliers of the elimination in the blocks. */
enum { KMP_FUSED_RATES = 1, KMP_FUSED_ACCELERATIONS, KMP_FUSED_MULTIPLIERS, KMP_FUSED_STAGES };

/** NULL: no memory. *factor (owned by the caller, in any case): what scaling the rows makes of each multiplier. */
kmp_program *kmp_fused_write(const kmp_reduction *red, double **factor, int *multipliers);

#endif
