/* SPDX-License-Identifier: BSD-3-Clause */
/* Measured motions from a CSV file: t, and columns of outputs with the names that they have in the tables of a run.
 * Empty cells are unknown. */
#pragma once

#include "analyses/sensitivity/sensitivity_study.h"
#include "base/arena.h"
#include "model/files/csv_reader.h"

typedef struct kmp_measured {
    kmp_arena arena;
    int rows, columns;
    double *t;     /* rows */
    char **name;   /* columns: of the columns that count */
    char *outputs; /* the same as words of `outputs`, separated by commas */
    double *value; /* rows x columns, SI; NaN: unknown */
} kmp_measured;

/** Reads names and times. `chosen`: names of the columns that count, separated by commas; NULL: all. KEMPE_E_INPUT with
 * file:line:column for each error; KEMPE_E_ARGUMENT: a chosen column is not there. */
kempe_status kmp_measured_begin(const kempe_model *model, const char *path, const char *chosen, kmp_measured *measured);

/** Reads the values, converted to the units of the columns of `rows`, which were requested by the words. */
kempe_status kmp_measured_read(const kempe_sensitivity *rows, const char *path, kmp_measured *measured);
void kmp_measured_free(kmp_measured *measured);
