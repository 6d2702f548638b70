/* SPDX-License-Identifier: BSD-3-Clause */
#include "base/memory.h"
#include "integrators/road.h"
#include "linalg/dense.h"
#include <string.h>

bool kmp_saddle_init(kmp_saddle *saddle, kmp_plant *plant, const kmp_partition *part)
{
    int size = part->n + part->r;
    *saddle = (kmp_saddle){.plant = plant, .part = part, .n = part->n, .r = part->r};
    saddle->matrix = KMP_NEW(double, size *size);
    saddle->x = KMP_NEW(double, size);
    saddle->pivot = KMP_NEW(int, size);
    return saddle->matrix && saddle->x && saddle->pivot;
}

void kmp_saddle_free(kmp_saddle *saddle)
{
    kmp_free(saddle->matrix);
    kmp_free(saddle->x);
    kmp_free(saddle->pivot);
    *saddle = (kmp_saddle){0};
}

/* Position of a row of h among the independent ones, -1 when dropped. */
static int position(const kmp_partition *part, int row)
{
    for (int k = 0; k < part->r; k++)
        if (part->rows[k] == row)
            return k;
    return -1;
}

int kmp_saddle_factor(kmp_saddle *saddle)
{
    const kmp_plant *plant = saddle->plant;
    const kmp_pattern *mass = &plant->system->mass, *jac = &plant->system->jacobian;
    int n = saddle->n, size = n + saddle->r;
    memset(saddle->matrix, 0, (size_t)(size * size) * sizeof(double));
    for (int k = 0; k < mass->count; k++)
        saddle->matrix[mass->row[k] + mass->col[k] * size] = saddle->matrix[mass->col[k] + mass->row[k] * size] =
            plant->mass[k];
    for (int k = 0, row = -1, at = -1; k < jac->count; k++) {
        if (jac->row[k] != row) {
            row = jac->row[k];
            at = position(saddle->part, row);
        }
        if (at < 0)
            continue;
        saddle->matrix[n + at + jac->col[k] * size] = plant->jacobian[k];
        saddle->matrix[jac->col[k] + (n + at) * size] = -plant->jacobian[k];
    }
    saddle->factorizations++;
    return kmp_lu_factor(size, saddle->matrix, saddle->pivot);
}

void kmp_saddle_accelerations(kmp_saddle *saddle, double *qdd, double *lambda)
{
    const kmp_plant *plant = saddle->plant;
    int n = saddle->n, r = saddle->r;
    for (int i = 0; i < n; i++)
        saddle->x[i] = -plant->bias[i];
    for (int k = 0; k < r; k++)
        saddle->x[n + k] = -plant->jdqd[saddle->part->rows[k]];
    kmp_lu_solve(n + r, saddle->matrix, saddle->pivot, 1, saddle->x);
    memcpy(qdd, saddle->x, (size_t)n * sizeof *qdd);
    if (!lambda)
        return;
    memset(lambda, 0, (size_t)plant->m * sizeof *lambda);
    for (int k = 0; k < r; k++)
        lambda[saddle->part->rows[k]] = saddle->x[n + k];
}

void kmp_saddle_correction(kmp_saddle *saddle, const double *violation, double *dx)
{
    int n = saddle->n, r = saddle->r;
    memset(saddle->x, 0, (size_t)n * sizeof *saddle->x);
    for (int k = 0; k < r; k++)
        saddle->x[n + k] = -violation[saddle->part->rows[k]];
    kmp_lu_solve(n + r, saddle->matrix, saddle->pivot, 1, saddle->x);
    memcpy(dx, saddle->x, (size_t)n * sizeof *dx);
}
