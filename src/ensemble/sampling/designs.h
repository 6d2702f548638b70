/* SPDX-License-Identifier: BSD-3-Clause */
/* Designs of experiments: points of the unit cube, each found by its number alone. */
#pragma once

#include <kempe/ensemble.h>
#include <stdbool.h>
#include <stdint.h>

typedef enum kmp_design {
    KMP_DESIGN_RANDOM,
    KMP_DESIGN_LATIN,
    KMP_DESIGN_SOBOL,
    KMP_DESIGN_SALTELLI,
    KMP_DESIGN_GRID
} kmp_design;
enum { KMP_SOBOL_MOST = 128 }; /* columns */

/** The design of a word of designs; false: there is none of it. */
bool kmp_design_find(const char *word, kmp_design *design);

/** Coordinate `column` of point k of `count`, in (0, 1), of a design of `columns`. Not for grids. */
double kmp_design_point(kmp_design design, uint64_t seed, uint64_t k, uint64_t count, int column, int columns);

/** Points of a group of Saltelli's design: two random ones A and B, then for each column A with that column of B. */
static inline int kmp_saltelli_group(int columns)
{
    return columns + 2;
}
