/* SPDX-License-Identifier: BSD-3-Clause */
/* The contribution of each input to the scatter of a value. */
#pragma once

#include <stdbool.h>

/** Standardised regression coefficients (columns) of a value over inputs, of `count` rows (row-major), and the part of
 * the variance that a linear function explains. false: the inputs do not vary, or depend on each other. */
bool kmp_regression(int count, int columns, const double *rows, const double *value, double *coefficients,
                    double *explained);

typedef struct kmp_sobol_index {
    double first, first_error; /* the part of the variance by the input alone, and its standard error */
    double total, total_error; /* with all its interactions */
} kmp_sobol_index;

/** True if the rows are groups of Saltelli's design (designs.h). */
bool kmp_is_saltelli(int count, int columns, const double *rows);

/** Sobol's indices from the values of such rows, by the estimators of Saltelli (2010) and Jansen (1999); groups with a
 * value that is not finite are left out. The number of groups used; 0: the value does not vary. */
int kmp_sobol_indices(int count, int columns, const double *value, kmp_sobol_index *indices);
