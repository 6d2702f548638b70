/* SPDX-License-Identifier: BSD-3-Clause */
/* States at which a condition of the equations changes: small motions have other equations on either side of it. */
#pragma once

#include "analyses/derivatives/linearized.h"

/** Looks at conditions that change at the state. The matrices and forces on all sides next to it may agree, and differ
 * at the state, as of teeth without load, which touch on neither flank: a state next to it then takes its place. If
 * they differ from side to side, and with `doubts`, small motions are doubted, once for `linear`. `damping`: not only
 * Kr counts, but also Gr and Mr. The matrices are present then, unless no condition changes. KEMPE_E_MEMORY. */
kempe_status kmp_linear_settle_switches(kmp_linear *linear, bool damping, bool doubts);

/** A side of the conditions that change at a state. */
typedef struct kmp_side {
    const char *condition; /* one that is not as on another side */
    bool balanced;         /* its forces are as large as at the state */
    bool leaves;           /* some motion from the state goes away, and stays on this side */
    double rate;           /* it grows as exp(rate t), where the side is balanced */
} kmp_side;

/** The side has its matrices in `linear`. */
typedef kempe_status kmp_side_fn(void *user, const kmp_linear *linear, const kmp_side *side);

/** Visits the sides of conditions that change at the state, if their matrices or forces differ. The matrices of the
 * state are present then. KEMPE_E_MEMORY, and what the visit returns. */
kempe_status kmp_linear_each_side(kmp_linear *linear, kmp_side_fn *visit, void *user);
