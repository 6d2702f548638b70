/* SPDX-License-Identifier: BSD-3-Clause */
/* Tables at many places at once. */
#pragma once

#include "symbolic/table_function.h"

/** Pieces and values of n points, a multiple of four, each times `sign`, equal to single calls to the bit.
 * kmp_table_find finds the pieces, which serve all derivatives. */
void kmp_table_find(const kmp_table *table, int n, double sign, const double *x, int *piece);
void kmp_table_values(const kmp_table *table, int derivative, int n, double sign, const double *x, const int *piece,
                      double *y);
/** Values and first derivatives. */
void kmp_table_both(const kmp_table *table, int n, double sign, const double *x, const int *piece, double *y,
                    double *slope);
