/* SPDX-License-Identifier: BSD-3-Clause */
#include "results/table.h"
#include "base/memory.h"
#include <string.h>

enum { TIME, WORK, FIRST_VALUE };

void kmp_table_init(kmp_table *table, int n, int m)
{
    *table = (kmp_table){.n = n, .m = m};
}

void kmp_table_free(kmp_table *table)
{
    kmp_free(table->data);
    *table = (kmp_table){0};
}

static size_t stride(const kmp_table *table)
{
    return FIRST_VALUE + 3 * (size_t)table->n + (size_t)table->m;
}

static double *row_of(const kmp_table *table, int row)
{
    return table->data + (size_t)row * stride(table);
}

static bool reserve(kmp_table *table)
{
    if (table->rows < table->capacity)
        return true;
    int capacity = table->capacity ? 2 * table->capacity : 64;
    double *data = kmp_realloc(table->data, (size_t)capacity, stride(table) * sizeof(double));
    if (!data)
        return false;
    table->data = data;
    table->capacity = capacity;
    return true;
}

static double *put(double *to, const double *from, int count)
{
    if (count > 0)
        memcpy(to, from, (size_t)count * sizeof *to);
    return to + count;
}

int kmp_table_add(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                  double work)
{
    kmp_table *table = user;
    if (!reserve(table))
        return -1;
    double *to = row_of(table, table->rows++);
    to[TIME] = t;
    to[WORK] = work;
    to = put(to + FIRST_VALUE, q, table->n);
    to = put(to, qd, table->n);
    to = put(to, qdd, table->n);
    put(to, lambda, table->m);
    return 0;
}

double kmp_table_time(const kmp_table *table, int row)
{
    return row_of(table, row)[TIME];
}

double kmp_table_work(const kmp_table *table, int row)
{
    return row_of(table, row)[WORK];
}

const double *kmp_table_get(const kmp_table *table, kmp_quantity quantity, int row)
{
    return row_of(table, row) + FIRST_VALUE + (int)quantity * table->n;
}
