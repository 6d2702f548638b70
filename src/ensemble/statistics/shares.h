/* SPDX-License-Identifier: BSD-3-Clause */
/* Shares of distributions of samples, for intervals of confidence. */
#pragma once

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
