/* SPDX-License-Identifier: BSD-3-Clause */
/* Distributions of several quantities as users write them, and their samples, each found by its number alone. */
#pragma once

#include "base/arena.h"
#include "ensemble/sampling/designs.h"
#include "ensemble/sampling/distributions.h"

typedef struct kmp_sampled_column {
    const char *name;
    kmp_distribution d;
    int levels; /* of a grid; 0: not given */
} kmp_sampled_column;

typedef struct kmp_sampling {
    const kempe_model *model;
    kmp_arena arena;
    kmp_design design;
    uint64_t seed;
    int count, columns; /* samples, and values of each */
    const char **name;
    kmp_sampled_column *column;
    double
        *factor; /* columns x columns, row-major: the lower Cholesky factor of the correlations; NULL: there are none */
} kmp_sampling;

/** Reads the ranges, correlations and design of the options for a model, which must outlive it. KEMPE_E_ARGUMENT: a
 * sentence says which is wrong. */
kempe_status kmp_sampling_new(const kempe_model *model, const kempe_sample_options *options, kmp_sampling **sampling);
void kmp_sampling_free(kmp_sampling *sampling);

/** Sample k: a value for each column. */
void kmp_sampling_row(const kmp_sampling *sampling, int k, double *row);
