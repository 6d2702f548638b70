/* SPDX-License-Identifier: BSD-3-Clause */
/* The values of an ensemble's instances (kempe/ensemble.h). */
#pragma once

#include "base/arena.h"
#include <kempe/ensemble.h>

struct kmp_sampling;

struct kempe_values {
    int columns, count;
    kmp_arena arena;
    char **name;                   /* columns */
    double *rows;                  /* count x columns; NULL: each row is drawn when it is needed */
    struct kmp_sampling *sampling; /* NULL: rows that are given */
    double *drawn;                 /* columns: the row drawn last */
    /* Origin: options of the sample, "" for those not given, or the file; NULL: neither. */
    const char *ranges, *correlations, *design, *file;
    int seed;
};

/** Copies or draws rows first .. first + count - 1, which the table has. */
void kmp_values_get(const kempe_values *values, int first, int count, double *rows);

/** The name of the value of a column of results, which is behind this prefix if a result has the same name. */
#define KMP_VALUE_PREFIX "value."
const char *kmp_value_name(const char *column);
