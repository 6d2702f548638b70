/* SPDX-License-Identifier: BSD-3-Clause */
/* The rows of a run or of a reference: time, q, qd, qdd, lambda, and the work of non-conservative forces so far. Grows
 * as rows come. */
#pragma once

#include "output/quantity.h"

typedef struct kmp_samples {
    int n, m;
    int rows;
    double *t, *work;              /* of each row */
    double *value[KMP_QUANTITIES]; /* rows x n (or m); in references NaN where not given */
    const bool *shared; /* m, of references, not their own: multipliers that redundant rows leave open, which are not
                         * judged; NULL: none */
    double
        *shown; /* rows x the width of outputs, where loads are shared as requested; NULL: as the equations have it */
} kmp_samples;

void kmp_samples_init(kmp_samples *table, int n, int m);
void kmp_samples_free(kmp_samples *table);

/** A kmp_row_fn whose user is the table: appends a copy. Nonzero when there is no memory. */
int kmp_samples_add(void *table, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                    double work);

/** A row more, all unknown (NaN); false: no memory. */
bool kmp_samples_extend(kmp_samples *table);

double kmp_samples_time(const kmp_samples *table, int row);
double kmp_samples_work(const kmp_samples *table, int row);

/** n or m values, owned by the table and valid until a row is added. */
const double *kmp_samples_get(const kmp_samples *table, kmp_quantity quantity, int row);

/** Forgets the rows after t_end. */
void kmp_samples_limit(kmp_samples *table, double t_end);
