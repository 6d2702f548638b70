/* SPDX-License-Identifier: BSD-3-Clause */
/* The rows of a run: time, q, qd, qdd, lambda, and the work of non-conservative forces so far. Grows as rows come. */
#ifndef KMP_OUTPUT_SAMPLES_H
#define KMP_OUTPUT_SAMPLES_H

#include "output/quantity.h"

typedef struct kmp_samples {
    int n, m;
    int rows, capacity;
    double *data; /* a row: t, work, q, qd, qdd, lambda */
} kmp_samples;

void kmp_samples_init(kmp_samples *table, int n, int m);
void kmp_samples_free(kmp_samples *table);

/** A kmp_row_fn whose user is the table: appends a copy. Nonzero when there is no memory. */
int kmp_samples_add(void *table, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                    double work);

double kmp_samples_time(const kmp_samples *table, int row);
double kmp_samples_work(const kmp_samples *table, int row);

/** n or m values, owned by the table and valid until a row is added. */
const double *kmp_samples_get(const kmp_samples *table, kmp_quantity quantity, int row);

#endif
