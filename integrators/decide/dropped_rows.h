/* SPDX-License-Identifier: BSD-3-Clause */
/* Rows of the closures that were dropped as redundant: whether they are still closed with the others, and whether the
 * kept ones still have their rank. The decisions of runs, of lanes and of generated simulators, which have this file
 * too. */
#pragma once

#include "integrators/decide/inlined.h"

/** The first of the dropped rows that is open; -1: none. h and row scales of all rows, `stride` apart; r kept and d
 * dropped rows. tolerance: rtol + atol of the run. loose: the gap of dropped rows that rounded numbers explain. */
KMP_INLINE int kmp_dropped_open(int r, const int *kept, int d, const int *dropped, ptrdiff_t stride, const double *h,
                                const double *row_scale, double tolerance, double loose)
{
    double allowed = fmax(KMP_DROPPED_WEIGHTS * tolerance, KMP_DROPPED_TOLERANCES * loose);
    for (int k = 0; d > 0 && k < r; k++)
        allowed = fmax(allowed, KMP_DROPPED_OVER_KEPT * (fabs(h[kept[k] * stride]) / row_scale[kept[k] * stride]));
    for (int k = 0; k < d; k++)
        if (!(fabs(h[dropped[k] * stride]) / row_scale[dropped[k] * stride] <= allowed))
            return dropped[k];
    return -1;
}

/** Rank of the kept rows. */
typedef enum kmp_kept_rank {
    KMP_KEPT_WELL,
    KMP_KEPT_BADLY, /* others are to be kept from here on */
    KMP_KEPT_LOST   /* they have nearly lost their rank: a step does not end here */
} kmp_kept_rank;

/** By the largest coefficient of a kept row in a dropped one, scaled: J_dropped = T J_kept
 * (constraints/partition/rank_margin.h); infinite where the kept rows are dependent. */
KMP_INLINE kmp_kept_rank kmp_dropped_judge(double coefficient)
{
    return !(coefficient <= KMP_ROWS_LOST)  ? KMP_KEPT_LOST
           : !(coefficient <= KMP_ROWS_OUT) ? KMP_KEPT_BADLY
                                            : KMP_KEPT_WELL;
}
