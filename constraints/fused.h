/* SPDX-License-Identifier: BSD-3-Clause */
/* The reduced right-hand side as one program, for one choice of u: from t, q and ud to qd and udd, the linear algebra
 * of eqs. (43)-(46) of Fisette and Samin 1996 written out with the equations, so that what is zero, or asked for by
 * nobody, is not there. The same numbers as reduction.h but for rounding. */
#ifndef KMP_CONSTRAINTS_FUSED_H
#define KMP_CONSTRAINTS_FUSED_H

#include "constraints/reduction.h"

typedef struct kmp_fused kmp_fused;

/** From a reduction with factors at hand, whose values say in which order rows are eliminated. *fused is NULL where
 *  there is none: large blocks, many freedoms, implicit blocks. KEMPE_E_MEMORY. */
kempe_status kmp_fused_new(kmp_fused **fused, const kmp_reduction *red);
void kmp_fused_free(kmp_fused *fused);

/** At (t, q, ud), with the plant's charts and its conditions as they are held: qd (n) and udd (p), which may be no
 *  numbers. false: the reduced mass is not positive. No allocation. */
bool kmp_fused_run(kmp_fused *fused, double t, const double *q, const double *ud, double *qd, double *udd);

/** Whether the conditions, if there are any, are held (kmp_plant_freeze): the program does not look for their changes.
 */
bool kmp_fused_applies(const kmp_fused *fused);

/** Whether the order of elimination is good at (t, q); otherwise what comes out may have lost digits. */
bool kmp_fused_is_good(kmp_fused *fused, double t, const double *q);

/** Operations of a run. */
kmp_counts kmp_fused_count(const kmp_fused *fused);

#endif
