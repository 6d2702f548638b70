/* SPDX-License-Identifier: BSD-3-Clause */
/* The choice of independent coordinates and of independent rows at the model's start, for generated files that compute
 * accelerations of closed loops. */
#pragma once

#include "exchange/code/source.h"

struct kmp_start_choice {
    int independent_count, dependent_count, row_count; /* rows: as many as dependent coordinates, and rows of modes */
    int *independent, *dependent, *rows;
    const char *missing; /* why there is no choice; NULL: there is one */
};

/** Sets source->choice. There is none where the model has rows that the file lacks, or where the closures
 * cannot be met at the start. */
kempe_status kmp_start_choose(kmp_code_source *source);
