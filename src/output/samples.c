/* SPDX-License-Identifier: BSD-3-Clause */
/* Rows of a run in one array that doubles when it is full, and a limit of their number. */
#include "output/samples.h"
#include "base/memory.h"
#include <math.h>
#include <string.h>

void kmp_samples_init(kmp_samples *table, int n, int m)
{
    *table = (kmp_samples){.n = n, .m = m};
}

void kmp_samples_free(kmp_samples *table)
{
    kmp_free(table->t);
    kmp_free(table->work);
    kmp_free(table->shown);
    for (int k = 0; k < KMP_QUANTITIES; k++)
        kmp_free(table->value[k]);
    *table = (kmp_samples){0};
}

static size_t width_of(const kmp_samples *table, int quantity)
{
    return (size_t)(quantity == KMP_QUANTITY_LAMBDA ? table->m : table->n);
}

/* Room for one more row of at least one number; false: no memory. */
static bool grow(double **array, size_t width, int rows)
{
    double *grown = kmp_list_room(*array, (size_t)rows, (width > 0 ? width : 1) * sizeof *grown);
    *array = grown ? grown : *array;
    return grown;
}

bool kmp_samples_extend(kmp_samples *table)
{
    bool ok = grow(&table->t, 1, table->rows) && grow(&table->work, 1, table->rows);
    for (int k = 0; k < KMP_QUANTITIES; k++)
        ok = ok && grow(&table->value[k], width_of(table, k), table->rows);
    if (!ok)
        return false;
    size_t row = (size_t)table->rows++;
    table->t[row] = table->work[row] = NAN;
    for (int k = 0; k < KMP_QUANTITIES; k++)
        for (size_t i = 0; i < width_of(table, k); i++)
            table->value[k][row * width_of(table, k) + i] = NAN;
    return true;
}

int kmp_samples_add(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                    double work)
{
    kmp_samples *table = user;
    const double *const from[KMP_QUANTITIES] = {q, qd, qdd, lambda};
    if (!kmp_samples_extend(table))
        return -1;
    size_t row = (size_t)table->rows - 1;
    table->t[row] = t;
    table->work[row] = work;
    for (int k = 0; k < KMP_QUANTITIES; k++)
        if (width_of(table, k) > 0)
            memcpy(table->value[k] + row * width_of(table, k), from[k], width_of(table, k) * sizeof(double));
    return 0;
}

double kmp_samples_time(const kmp_samples *table, int row)
{
    return table->t[row];
}

double kmp_samples_work(const kmp_samples *table, int row)
{
    return table->work[row];
}

const double *kmp_samples_get(const kmp_samples *table, kmp_quantity quantity, int row)
{
    return table->value[quantity] + (size_t)row * width_of(table, (int)quantity);
}

void kmp_samples_limit(kmp_samples *table, double t_end)
{
    while (table->rows > 0 && table->t[table->rows - 1] > t_end)
        table->rows--;
}
