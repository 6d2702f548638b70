/* SPDX-License-Identifier: BSD-3-Clause */
/* A trajectory as columns: time, then what the model's outputs ask for, in their order; each with its unit. */
#ifndef KMP_RESULTS_COLUMNS_H
#define KMP_RESULTS_COLUMNS_H

#include "results/trajectory.h"

typedef struct kmp_columns {
    int count;
    char **name, **unit; /* unit: SI, "" where a sensor has none */
} kmp_columns;

/** false: no memory. */
bool kmp_columns_init(kmp_columns *columns, const kempe_system *system);
void kmp_columns_free(kmp_columns *columns);

/** The values (count) of a row; NaN where there is none. */
void kmp_columns_fill(const kempe_trajectory *trajectory, kmp_plant *plant, int row, double *values);

#endif
