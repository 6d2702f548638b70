/* SPDX-License-Identifier: BSD-3-Clause */
/* Parameters with bounds as users write them, NAME[:LOW:HIGH], and results of a search as the start of another one. */
#pragma once

#include "base/arena.h"
#include "base/context.h"

typedef struct kmp_box_bounds {
    int count;
    char **name;
    double *lower, *upper; /* infinite: none */
} kmp_box_bounds;

/** Reads NAME, NAME:LOW:HIGH or NAME=LOW:HIGH, NAME:LOW:, NAME::HIGH, separated by commas. KEMPE_E_ARGUMENT. */
kempe_status kmp_box_bounds_read(const kempe_model *model, const char *list, kmp_arena *arena, kmp_box_bounds *bounded);

/** KEMPE_E_ARGUMENT: a start is not within its bounds. */
kempe_status kmp_box_bounds_check(kempe_context *context, const kmp_box_bounds *bounded, const double *start);

/** Values from a CSV file with the columns `parameter` and `value`. Errors of CSV files; KEMPE_E_INPUT: a parameter has
 * no row. */
kempe_status kmp_box_bounds_read_start(kempe_context *context, const char *path, const kmp_box_bounds *bounded,
                                       double *start);
