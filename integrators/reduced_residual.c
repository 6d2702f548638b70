/* SPDX-License-Identifier: BSD-3-Clause */
#include "integrators/reduced_residual.h"
#include <string.h>

/* Column k: u'[k] or -ud[k], then the rows of the motion and of the work, which are full. */
static void fill_pattern(kmp_reduced_residual *d)
{
    int nz = 0;
    for (int c = 0; c < d->size; c++) {
        d->col_start[c] = nz;
        if (c < 2 * d->p)
            d->row[nz++] = c % d->p;
        for (int i = c < 2 * d->p ? d->p : c; i < d->size; i++)
            d->row[nz++] = i;
    }
    d->col_start[d->size] = nz;
}

bool kmp_reduced_residual_init(kmp_reduced_residual *residual, int p, bool power)
{
    kmp_reduced_residual *d = residual;
    int size = 2 * p + power;
    *d = (kmp_reduced_residual){.p = p, .size = size};
    kmp_arena *a = &d->arena;
    d->col_start = KMP_ARENA_NEW(a, long, size + 1);
    d->row = KMP_ARENA_NEW(a, long, size *(size + 1));
    d->differential = d->factor = KMP_ARENA_NEW(a, double, size);
    d->jacobian = KMP_ARENA_NEW(a, double, size *size);
    if (a->failed)
        return false;
    for (int i = 0; i < size; i++)
        d->factor[i] = 1;
    fill_pattern(d);
    return true;
}

void kmp_reduced_residual_free(kmp_reduced_residual *residual)
{
    kmp_arena_free(&residual->arena);
    *residual = (kmp_reduced_residual){0};
}

void kmp_reduced_residual_describe(const kmp_reduced_residual *residual, kmp_dae *dae)
{
    dae->n = residual->size;
    dae->nz = (int)residual->col_start[residual->size];
    dae->col_start = residual->col_start;
    dae->row = residual->row;
    dae->differential = residual->differential;
    dae->factor = residual->factor;
}

void kmp_reduced_residual_matrix(kmp_reduced_residual *residual, kmp_reduced_jacobian *jacobian, double t, double cj,
                                 const double *q, const double *qd, const double *udd, double *values)
{
    kmp_reduced_residual *d = residual;
    memset(d->jacobian, 0, (size_t)(d->size * d->size) * sizeof *d->jacobian);
    kmp_reduced_jacobian_of_residual(jacobian, t, cj, q, qd, udd, d->size, d->jacobian);
    for (int c = 0; c < d->size; c++)
        for (long k = d->col_start[c]; k < d->col_start[c + 1]; k++)
            values[k] = d->jacobian[d->row[k] + (long)c * d->size];
}
