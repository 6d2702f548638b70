/* SPDX-License-Identifier: BSD-3-Clause */
/* How modes change with a parameter: eigenvalues followed from value to value, by their distance and by how alike their
 * shapes are, so that curves that cross go on as themselves; and the values at which one of them begins to grow. Where
 * a step is too long to tell which is which, values between are looked at, too. */
#ifndef KMP_STUDIES_MODES_LOCUS_H
#define KMP_STUDIES_MODES_LOCUS_H

#include "studies/modes/operating_family.h"

/** A value at which a mode begins to grow, or ceases to. */
typedef struct kmp_critical {
    double value, re, im; /* the eigenvalue there; im >= 0 */
    int branch;
    bool grows_above;
} kmp_critical;

typedef struct kmp_locus {
    kmp_arena arena;   /* of all arrays but critical */
    int values, count; /* how many of each */
    double *value;
    double *re, *im; /* count x values: branch b at value k is [b + k*count] */
    double *doubt;   /* values: what the least certain step to it was, 0 to 1 */
    kmp_critical *critical;
    int critical_count;
    int reached; /* values that were reached; fewer when one failed */
} kmp_locus;

/** At `count` values (2 or more) of what varies. KEMPE_E_FAILED: none could be reached; KEMPE_STOPPED: some could not,
 * or an interrupt; the locus is then there as far as it goes, and the context has why. */
kempe_status kmp_locus_make(kmp_station *station, int count, const double *values, kmp_locus *locus);
void kmp_locus_free(kmp_locus *locus);

#endif
