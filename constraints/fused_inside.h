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

/** The order in which partial pivoting takes rows now, from the plant's last closure, block by block (r of them; places
 * among the independent rows). */
void kmp_fused_order(const kmp_reduction *red, int *order);

/** For several instances at once, of any order and scales of rows (m): the accelerations end with the power of the
 * non-conservative forces, and the last stage has what is watched at the end of a step: h (r), all of J
 * (jacobian.count), -Jv^-1 h (r), Bvu (r x p, row by row), the determinants of the blocks but for the order of rows,
 * and the multipliers. */
kmp_program *kmp_fused_write_watched(const kmp_reduction *red, const int *order, const double *row_scale,
                                     double **factor, int *multipliers);

#endif
