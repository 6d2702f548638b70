/* SPDX-License-Identifier: BSD-3-Clause */
/* Dense LU of a compressed-column matrix: the least overhead below ten unknowns, and the simplest solver. */
#include "base/memory.h"
#include "integrators/sundials/linear.h"
#include "linalg/dense/dense.h"

#include <string.h>

typedef struct full {
    kmp_linear_head head; /* first */
    int n;
    double *lu;
    int *pivot;
} full;

static int setup(SUNLinearSolver s, SUNMatrix a)
{
    full *d = s->content;
    const sunindextype *start = SUNSparseMatrix_IndexPointers(a), *row = SUNSparseMatrix_IndexValues(a);
    const double *value = SUNSparseMatrix_Data(a);
    size_t n = (size_t)d->n;
    memset(d->lu, 0, n * n * sizeof *d->lu);
    for (size_t c = 0; c < n; c++)
        for (sunindextype k = start[c]; k < start[c + 1]; k++)
            d->lu[(size_t)row[k] + c * n] += value[k];
    return d->head.last = kmp_lu_factor(d->n, d->lu, d->pivot) ? SUNLS_LUFACT_FAIL : 0;
}

static int solve(SUNLinearSolver s, SUNMatrix a, N_Vector x, N_Vector b, sunrealtype tolerance)
{
    (void)a;
    (void)tolerance;
    full *d = s->content;
    if (kmp_sun_data(x) != kmp_sun_data(b))
        memcpy(kmp_sun_data(x), kmp_sun_data(b), (size_t)d->n * sizeof(double));
    kmp_lu_solve(d->n, d->lu, d->pivot, 1, kmp_sun_data(x));
    return d->head.last = 0;
}

static void release(void *content)
{
    full *d = content;
    kmp_free(d->lu);
    kmp_free(d->pivot);
    kmp_free(d);
}

SUNLinearSolver kmp_linear_dense(SUNMatrix a, SUNContext context)
{
    long n = SUNSparseMatrix_Columns(a);
    static const kmp_linear_ops ops = {setup, solve, release};
    full *d = KMP_NEW(full, 1);
    if (!d)
        return NULL;
    d->n = (int)n;
    d->lu = KMP_NEW(double, n *n);
    d->pivot = KMP_NEW(int, n);
    if (d->lu && d->pivot)
        return kmp_linear_wrap(&d->head, &ops, context);
    release(d);
    return NULL;
}
