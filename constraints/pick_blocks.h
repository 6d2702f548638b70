/* SPDX-License-Identifier: BSD-3-Clause */
/* What pick.c and pick_blocks.c share. */
#ifndef KMP_CONSTRAINTS_PICK_BLOCKS_H
#define KMP_CONSTRAINTS_PICK_BLOCKS_H

#include "constraints/pick.h"

/* The worst over all blocks. */
typedef struct kmp_pick_quality {
    double max_b, norm, inverse; /* |Bvu|, ||Jv||_1, ||Jv^-1||_1 */
} kmp_pick_quality;

/** The columns at places i and k change them. */
void kmp_pick_swap(kmp_pick *c, int i, int k);

kmp_pick_outcome kmp_pick_improve_dense(kmp_pick *c, int r, int most, int *exchanges, kmp_pick_quality *quality);
kmp_pick_outcome kmp_pick_improve_blocks(kmp_pick *c, int r, int most, int *exchanges, kmp_pick_quality *quality);

#endif
