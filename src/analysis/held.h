/* SPDX-License-Identifier: BSD-3-Clause */
/* States at which some coordinates are held, at rest or at a rate, by whatever that takes, and the others are in
 * balance: R_k = 0 of these alone (analysis/equilibrium.h has R and how it is judged). Of a held coordinate the rate
 * may be unknown instead, so that nothing drives it. */
#ifndef KMP_ANALYSIS_HELD_H
#define KMP_ANALYSIS_HELD_H

#include "analysis/equilibrium.h"

typedef struct kmp_hold {
    int coordinate;
    bool freed; /* its rate is found; R = 0 of it, too */
} kmp_hold;

typedef struct kmp_held {
    int count;
    const kmp_hold *hold;
    kmp_steady *rates; /* of the same coordinates: given, and found where freed */
    double residual;   /* of the last state, relative */
    int iterations;
} kmp_held;

/** From q (n), whose held coordinates are where they shall be, and closed on them by it; it becomes the state, with
 *  `linear` and its matrices. KEMPE_E_FAILED: there is none, or it is not found, and why; q and rates stay. */
kempe_status kmp_held_find(kmp_linear *linear, double t, double *q, kmp_held *held);

#endif
