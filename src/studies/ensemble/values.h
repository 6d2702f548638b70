/* SPDX-License-Identifier: BSD-3-Clause */
/* The values of an ensemble's instances (kempe/ensemble.h). */
#pragma once

#include "base/arena.h"
#include <kempe/ensemble.h>

struct kempe_values {
    int columns, count;
    kmp_arena arena;
    char **name;  /* columns */
    double *rows; /* count x columns */
};

/** An empty table with a copy of the names. NULL: no memory. */
kempe_values *kmp_values_new(int columns, const char *const *names);
/** A row more, to be filled. NULL: no memory. */
double *kmp_values_add(kempe_values *values);
