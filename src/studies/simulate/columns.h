/* SPDX-License-Identifier: BSD-3-Clause */
/* A trajectory as columns: time, then what the model's outputs ask for, in their order; each with its unit. */
#ifndef KMP_STUDIES_SIMULATE_COLUMNS_H
#define KMP_STUDIES_SIMULATE_COLUMNS_H

#include "studies/simulate/trajectory.h"

/** Where the value of a column is: number `index` of a quantity, or (KMP_QUANTITIES) of what is shown beside the table.
 *  It is that component of that output. */
typedef struct kmp_column {
    kmp_quantity quantity;
    int index, output, component;
} kmp_column;

/** Unit of entry k of a quantity, and of what an output computes. */
const char *kmp_columns_unit(const kempe_system *system, kmp_quantity quantity, int k);
const char *kmp_columns_unit_shown(kmp_output_kind kind);

typedef struct kmp_columns {
    int count;
    char **name, **unit; /* unit: SI, "" where a sensor has none */
    kmp_column *of;      /* of the first, which is time: output -1 */
} kmp_columns;

/** false: no memory. */
bool kmp_columns_init(kmp_columns *columns, const kempe_system *system);
void kmp_columns_free(kmp_columns *columns);

/** The values (count) of a row; NaN where there is none. */
void kmp_columns_fill(const kempe_trajectory *trajectory, const kmp_columns *columns, kmp_plant *plant, int row,
                      double *values);

#endif
