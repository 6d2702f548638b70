/* SPDX-License-Identifier: BSD-3-Clause */
/* A trajectory as columns: time, then the model's outputs, in their order; each with its unit. */
#pragma once

#include "studies/simulate/trajectory.h"

/** The source of a column's value: number `index` of a quantity, or (KMP_QUANTITIES) of the outputs in addition to the
 * table. It is component `part` of output `output`. */
typedef struct kmp_column {
    kmp_quantity quantity;
    int index, output, component;
} kmp_column;

typedef struct kmp_columns {
    int count;
    char **name;
    const char **unit; /* SI, "" where a sensor has none */
    kmp_column *of;    /* of the first, which is time: output -1 */
    kmp_arena arena;
} kmp_columns;

/** Columns of the outputs of a model with the coordinates and rows of a system: its own or a copy with other outputs.
 * `parts`: by output, a bit for each requested component; NULL: all. false: no memory. */
bool kmp_columns_init(kmp_columns *columns, const kempe_system *system, const kempe_model *model,
                      const unsigned *parts);
void kmp_columns_free(kmp_columns *columns);

/** The values (count) of a row; NaN where there is none. */
void kmp_columns_fill(const kmp_samples *table, const kmp_columns *columns, kmp_evaluator *eval, int row,
                      double *values);
