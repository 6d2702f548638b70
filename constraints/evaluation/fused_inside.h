/* SPDX-License-Identifier: BSD-3-Clause */
/* The program of fused.c, which fused_write.c makes. */
#ifndef KMP_CONSTRAINTS_EVALUATION_FUSED_INSIDE_H
#define KMP_CONSTRAINTS_EVALUATION_FUSED_INSIDE_H

#include "constraints/partition/reduction.h"

enum { KMP_FUSED_FREEDOMS = 8, KMP_FUSED_BLOCK = 24 }; /* at most: independent coordinates, rows of a block of Jv */

/** A multiplier of the elimination, rows scaled, beyond which its order is no longer good. */
#define KMP_FUSED_MULTIPLIER 10.0

/* Stages: qd of v from (t, q) and qd of u; udd, then the pivots of the reduced mass; what is wanted at the end of a
 * step. Without the user's efforts, which are functions of qd, the first has all that: udd, qd of v, pivots. */
enum { KMP_FUSED_RATES = 1, KMP_FUSED_ACCELERATIONS, KMP_FUSED_END, KMP_FUSED_STAGES };

/* Outputs of the end: the multipliers of the elimination in the blocks, a pivot or determinant for each factor of det
 * Jv, h, J, h_t where there is one, Bvu, the correction of v. */
typedef struct kmp_fused_layout {
    int multipliers, pivots;
    double *factor; /* of each multiplier: what scaling rows makes of it; owned by the caller, in any case */
} kmp_fused_layout;

/** What the program is written for. */
typedef struct kmp_fused_plan {
    const int *order;        /* of rows in the elimination: r places among the independent rows, block by block */
    const double *row_scale; /* m */
    bool power;              /* of the non-conservative forces, behind the pivots of the reduced mass */
} kmp_fused_plan;

/** The order in which partial pivoting takes the rows now, from the plant's last closure. */
void kmp_fused_order(const kmp_reduction *red, int *order);

/** NULL: no memory. */
kmp_program *kmp_fused_write(const kmp_reduction *red, const kmp_fused_plan *plan, kmp_fused_layout *layout);

#endif
