/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/tables/named_table.h"
#include "symbolic/table.h"

int kmp_named_table_check(int count, const double *x, const double *y)
{
    return kmp_table_check(count, x, y);
}

bool kmp_named_table_make(kmp_named_table *table, bool linear, int count, const double *x, const double *y)
{
    table->table = kmp_table_new(linear ? KMP_TABLE_LINEAR : KMP_TABLE_CUBIC, count, x, y);
    return table->table;
}

void kmp_named_table_free(kmp_named_table *table)
{
    if (table->table)
        kmp_table_free(table->table);
    table->table = NULL;
}
