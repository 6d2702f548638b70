/* SPDX-License-Identifier: BSD-3-Clause */
/* KLU for IDA: the wrapper of linalg/sparse.h as a linear solver. */
#include "integrators/sundials/linear.h"
#include "linalg/sparse.h"

#include <stdbool.h>
#include <string.h>

typedef struct klu {
    kmp_sparse *sparse;
    bool analysed;
} klu;

static void *create(SUNMatrix a, kmp_arena *arena)
{
    klu *k = KMP_ARENA_NEW(arena, klu, 1);
    if (k)
        k->sparse = kmp_sparse_new_columns((int)SUNSparseMatrix_Columns(a), (int)SUNSparseMatrix_NNZ(a));
    return k && k->sparse ? k : NULL;
}

static int factor(void *self, SUNMatrix a)
{
    static const int meaning[] = {[KMP_SPARSE_FACTORED] = 0,
                                  [KMP_SPARSE_SINGULAR] = SUNLS_LUFACT_FAIL,
                                  [KMP_SPARSE_NO_MEMORY] = KMP_SUN_NO_MEMORY,
                                  [KMP_SPARSE_FAILED] = KMP_SUN_PACKAGE_FAILED};
    klu *k = self;
    k->analysed = k->analysed ||
                  kmp_sparse_take_columns(k->sparse, SUNSparseMatrix_IndexPointers(a), SUNSparseMatrix_IndexValues(a));
    return k->analysed ? meaning[kmp_sparse_factor(k->sparse, SUNSparseMatrix_Data(a))] : KMP_SUN_NO_MEMORY;
}

static int solve(void *self, SUNMatrix a, double *x, const double *b)
{
    if (x != b)
        memcpy(x, b, (size_t)SUNSparseMatrix_Columns(a) * sizeof *x);
    return kmp_sparse_solve(((klu *)self)->sparse, 1, x) ? 0 : KMP_SUN_PACKAGE_FAILED;
}

static void release(void *self)
{
    kmp_sparse_free(((klu *)self)->sparse);
}

static int64_t fill(void *self)
{
    return kmp_sparse_fill(((klu *)self)->sparse);
}

const kmp_linear_kind kmp_linear_klu = {"klu", NULL, create, factor, solve, release, fill};
