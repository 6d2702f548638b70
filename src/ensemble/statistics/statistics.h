/* SPDX-License-Identifier: BSD-3-Clause */
/* Statistics of instances (kempe/ensemble.h) as their report page reads them, with intervals of confidence and the
 * contribution of each input to the scatter of a value. */
#pragma once

#include "base/json.h"
#include <kempe/ensemble.h>
#include <stdbool.h>

/** The regularised incomplete beta function I_x(a, b), a, b > 0. */
double kmp_beta_share(double x, double a, double b);

/** The x with I_x(a, b) = part; 0 for a = 0, 1 for b = 0. */
double kmp_beta_quantile(double part, double a, double b);

/** The number with the share `part` of Student's distribution below it. */
double kmp_student_quantile(double part, double freedoms);

/** The share of binomial distributions: at most k of n successes of chance p. */
double kmp_binomial_share(int k, int n, double p);

/** The interval of Clopper and Pearson of a chance of which k of n trials succeeded. */
void kmp_chance_interval(int k, int n, double confidence, double *low, double *high);

/** Places, from 1, of the order statistics of n samples between which the quantile of `part` lies with confidence; 0
 * and n + 1: there is none so far out. */
void kmp_quantile_places(int n, double part, double confidence, int *low, int *high);

/** Standardised regression coefficients (columns) of a value over inputs, of `count` rows (row-major), and the part of
 * the variance that a linear function explains. false: the inputs do not vary, or depend on each other. */
bool kmp_regression(int count, int columns, const double *rows, const double *value, double *coefficients,
                    double *explained);

typedef struct kmp_sobol_index {
    double first, first_error; /* the part of the variance by only the input, and its standard error */
    double total, total_error; /* with all its interactions */
} kmp_sobol_index;

/** True if the rows are groups of Saltelli's design (sampling.h). */
bool kmp_is_saltelli(int count, int columns, const double *rows);

/** True if the rows are all combinations of evenly spaced values of the columns, in order, which are not a sample. */
bool kmp_is_grid(int count, int columns, const double *rows);

/** Sobol's indices from the values of groups of Saltelli's design, by the estimators of Saltelli (2010) and Jansen
 * (1999); groups with a value that is not finite are left out. The number of groups used; 0: the value does not vary.
 */
int kmp_sobol_indices(int count, int columns, const double *value, kmp_sobol_index *indices);

/** Writes a member with all of them; null for NULL. */
void kmp_statistics_put(kmp_json *json, const char *key, const kempe_statistics *statistics);

/** The part of the instances within the limits, with its interval; false: there are no limits, or nothing is known. */
bool kmp_statistics_yield(const kempe_statistics *statistics, double *part, double *low, double *high);

/** True for the column of a quantity; for a table that has one. */
bool kmp_statistics_is_quantity(const kempe_table *instances, int column);
bool kmp_statistics_has_quantities(const kempe_table *instances);

/** Marks the columns of a table "instances" that its statistics read; the table may have no rows. false: it has no
 * quantities. */
bool kmp_statistics_choose(const kempe_table *instances, bool *chosen);

/** Statistics of a result folder whose rows are `instances`; the words that repeat an extreme name the folder. */
kempe_status kmp_statistics_of_folder(const kempe_table *instances, const char *folder, kempe_statistics **statistics);
