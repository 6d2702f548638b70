/* SPDX-License-Identifier: BSD-3-Clause */
/* Designs of experiments, distributions, and distributions of several quantities as users write them with their
 * samples, each found only by its number. */
#pragma once

#include "base/arena.h"
#include <kempe/ensemble.h>
#include <kempe/kempe.h>
#include <stdbool.h>
#include <stdint.h>

/* Designs of experiments: points of the unit cube, each found only by its number. */

typedef enum kmp_design {
    KMP_DESIGN_RANDOM,
    KMP_DESIGN_LATIN,
    KMP_DESIGN_SOBOL,
    KMP_DESIGN_SALTELLI,
    KMP_DESIGN_GRID
} kmp_design;
enum { KMP_SOBOL_MOST = 128 }; /* columns */

/** Coordinate `column` of point k of `count`, in (0, 1), of a design of `columns`. Not for grids. */
double kmp_design_point(kmp_design design, uint64_t seed, uint64_t k, uint64_t count, int column, int columns);

/** Points of a group of Saltelli's design: two random ones A and B, then for each column A with that column of B. */
static inline int kmp_saltelli_group(int columns)
{
    return columns + 2;
}

typedef enum kmp_distribution_kind { KMP_UNIFORM, KMP_NORMAL, KMP_TRIANGULAR } kmp_distribution_kind;

typedef struct kmp_distribution {
    kmp_distribution_kind kind;
    double least, most;   /* infinite for a normal one that is not truncated */
    double centre, width; /* mean and standard deviation of the normal distribution before truncation; mode */
} kmp_distribution;

/** Standard normal distribution: the share below z, and its inverse. */
double kmp_normal_share(double z);
double kmp_normal_quantile(double part);

enum { KMP_GRADE_LEAST = 5, KMP_GRADE_MOST = 18 };

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
