/* SPDX-License-Identifier: BSD-3-Clause */
#include "output/samples.h"
#include "base/memory.h"
#include <string.h>

enum { TIME, WORK, FIRST_VALUE };

void kmp_samples_init(kmp_samples *table, int n, int m)
{
    *table = (kmp_samples){.n = n, .m = m};
}

void kmp_samples_free(kmp_samples *table)
{
    kmp_free(table->data);
    *table = (kmp_samples){0};
}

static size_t stride(const kmp_samples *table)
{
    return FIRST_VALUE + 3 * (size_t)table->n + (size_t)table->m;
}

static double *row_of(const kmp_samples *table, int row)
{
    return table->data + (size_t)row * stride(table);
}

static bool reserve(kmp_samples *table)
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

int kmp_samples_add(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                    double work)
{
    kmp_samples *table = user;
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

double kmp_samples_time(const kmp_samples *table, int row)
{
    return row_of(table, row)[TIME];
}

double kmp_samples_work(const kmp_samples *table, int row)
{
    return row_of(table, row)[WORK];
}

const double *kmp_samples_get(const kmp_samples *table, kmp_quantity quantity, int row)
{
    return row_of(table, row) + FIRST_VALUE + (int)quantity * table->n;
}
