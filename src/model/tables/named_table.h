/* SPDX-License-Identifier: BSD-3-Clause */
/* The tables of the graph for functions that read files: the graph's nodes and the file's share a name. */
#ifndef KMP_MODEL_TABLES_NAMED_TABLE_H
#define KMP_MODEL_TABLES_NAMED_TABLE_H

#include "model/expressions/expression.h"

/** -1 when a table can be made of the points, otherwise the index of the first bad one. */
int kmp_named_table_check(int count, const double *x, const double *y);

/** false: no memory. */
bool kmp_named_table_make(kmp_named_table *table, bool linear, int count, const double *x, const double *y);
void kmp_named_table_free(kmp_named_table *table);

#endif
