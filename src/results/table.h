/* SPDX-License-Identifier: BSD-3-Clause */
/* The rows of a run: time, q, qd, qdd, lambda, and the work of non-conservative forces so far. Grows as rows come. */
#ifndef KMP_RESULTS_TABLE_H
#define KMP_RESULTS_TABLE_H

#include "results/quantity.h"

typedef struct kmp_table {
    int n, m;
    int rows, capacity;
    double *data; /* a row: t, work, q, qd, qdd, lambda */
} kmp_table;

void kmp_table_init(kmp_table *table, int n, int m);
void kmp_table_free(kmp_table *table);

/** A kmp_row_fn whose user is the table: appends a copy. Nonzero when there is no memory. */
int kmp_table_add(void *table, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                  double work);

double kmp_table_time(const kmp_table *table, int row);
double kmp_table_work(const kmp_table *table, int row);

/** n or m values, owned by the table and valid until a row is added. */
const double *kmp_table_get(const kmp_table *table, kmp_quantity quantity, int row);

#endif
