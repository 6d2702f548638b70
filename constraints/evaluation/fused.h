/* SPDX-License-Identifier: BSD-3-Clause */
/* The reduced right-hand side as one program, for one choice of u: from t, q and ud to qd and udd, the linear algebra
 * of eqs. (43)-(46) of Fisette and Samin 1996 written out with the equations, so that what is zero, or asked for by
 * nobody, is not there. The same numbers as reduction.h but for rounding. */
#ifndef KMP_CONSTRAINTS_EVALUATION_FUSED_H
#define KMP_CONSTRAINTS_EVALUATION_FUSED_H

#include "constraints/partition/reduction.h"

typedef struct kmp_fused kmp_fused;

/** From a reduction with factors at hand, of the plant's last closure, whose values say in which order rows are
 * eliminated. *fused is NULL where there is none: large blocks, many freedoms, implicit blocks. KEMPE_E_MEMORY. */
kempe_status kmp_fused_new(kmp_fused **fused, const kmp_reduction *red);
void kmp_fused_free(kmp_fused *fused);

/** At (t, y), y = (u, ud, v), with the plant's charts and its conditions as they are held: dy = (ud, udd, vd), which
 *  may be no numbers. false: the reduced mass is not positive. No allocation. */
bool kmp_fused_run(kmp_fused *fused, double t, const double *y, double *dy);

/** The power of the non-conservative forces of such a system, the user's among them, where that was last. */
double kmp_fused_power(const kmp_fused *fused);

/** Whether the conditions, if there are any, are held (kmp_plant_freeze): the program does not look for their changes.
 */
bool kmp_fused_applies(const kmp_fused *fused);

/** What the end of a step wants to know of the place where kmp_fused_run was last: of its own until it runs again. */
typedef struct kmp_fused_end {
    bool good;                        /* the order of elimination; otherwise what comes out may have lost digits */
    bool regular;                     /* Jv */
    const int *signs;                 /* of its blocks, as kmp_block_take_signs has them */
    const double *h, *jacobian, *h_t; /* as those of kmp_plant */
    const double *bvu, *dv;           /* as those of kmp_reduction: Bvu, the correction of v */
} kmp_fused_end;

kmp_fused_end kmp_fused_at_end(kmp_fused *fused);

/** Whether the order of elimination is good at (t, y). */
bool kmp_fused_is_good(kmp_fused *fused, double t, const double *y);

/** Operations of a run. */
kmp_counts kmp_fused_count(const kmp_fused *fused);

#endif
