/* SPDX-License-Identifier: BSD-3-Clause */
/* Modes as functions of a parameter. Eigenvalues are followed from value to value by their distance and the similarity
 * of their shapes, so that crossing curves continue correctly. The study also finds the values at which one of them
 * begins to grow. If a step is too long to identify them, intermediate values are computed. */
#pragma once

#include "analyses/modes/operating_family.h"

/** A value at which a mode begins to grow, or ceases to. */
typedef struct kmp_critical {
    double value, re, im; /* the eigenvalue there; im >= 0 */
    int branch;
    bool grows_above;
} kmp_critical;

typedef struct kmp_locus {
    kmp_arena arena;   /* of all arrays but critical */
    int values, count; /* numbers of them */
    double *value;
    double *re, *im; /* count x values: branch b at value k is [b + k*count] */
    double *q;       /* n x values: the states, in the user's coordinates */
    double *load;    /* n x values: the loads that hold rates at these states, N or N m; NaN: none */
    double *doubt;   /* values: the doubt of the least certain step to it; above 1: uncertain */
    kmp_critical *critical;
    int critical_count;
    int reached; /* values that were reached; fewer when one failed */
} kmp_locus;

/** Computes the locus at `count` values (2 or more) of the parameter. KEMPE_E_FAILED: none could be reached.
 * KEMPE_STOPPED: some could not, or an interrupt; the locus then has the values so far, and the context the reason. */
kempe_status kmp_locus_make(kmp_operating_family *family, int count, const double *values, kmp_locus *locus);

/** True if a load holds the rate of coordinate i at one of the values. */
bool kmp_locus_has_load(const kmp_locus *locus, int n, int i);
void kmp_locus_free(kmp_locus *locus);
