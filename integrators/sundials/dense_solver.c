/* SPDX-License-Identifier: BSD-3-Clause */
/* Dense LU of a compressed-column matrix: the least overhead below ten unknowns, and the simplest solver. */
#include "integrators/sundials/linear.h"
#include "linalg/dense/dense.h"

#include <string.h>

typedef struct full {
    int n;
    double *lu;
    int *pivot;
} full;

static void *create(SUNMatrix a, kmp_arena *arena)
{
    int64_t n = SUNSparseMatrix_Columns(a);
    full *d = KMP_ARENA_NEW(arena, full, 1);
    if (!d)
        return NULL;
    *d = (full){(int)n, KMP_ARENA_NEW(arena, double, n *n), KMP_ARENA_NEW(arena, int, n)};
    return arena->failed ? NULL : d;
}

static int factor(void *self, SUNMatrix a)
{
    full *d = self;
    const sunindextype *start = SUNSparseMatrix_IndexPointers(a), *row = SUNSparseMatrix_IndexValues(a);
    const double *value = SUNSparseMatrix_Data(a);
    size_t n = (size_t)d->n;
    memset(d->lu, 0, n * n * sizeof *d->lu);
    for (size_t c = 0; c < n; c++)
        for (sunindextype k = start[c]; k < start[c + 1]; k++)
            d->lu[(size_t)row[k] + c * n] += value[k];
    return kmp_lu_factor(d->n, d->lu, d->pivot) ? SUNLS_LUFACT_FAIL : 0;
}

static int solve(void *self, SUNMatrix a, double *x, const double *b)
{
    (void)a;
    full *d = self;
    if (x != b)
        memcpy(x, b, (size_t)d->n * sizeof *x);
    kmp_lu_solve(d->n, d->lu, d->pivot, 1, x);
    return 0;
}

static int64_t fill(void *self)
{
    int64_t n = ((full *)self)->n;
    return n * n;
}

const kmp_linear_kind kmp_linear_dense = {"dense", NULL, create, factor, solve, NULL, fill};
