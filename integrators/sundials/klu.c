/* SPDX-License-Identifier: BSD-3-Clause */
/* KLU for IDA: the wrapper of linalg/sparse.h behind a SUNLinearSolver. */
#include "base/memory.h"
#include "integrators/sundials/linear.h"
#include "linalg/sparse.h"

#include <stdbool.h>
#include <string.h>

typedef struct klu {
    kmp_linear_head head; /* first */
    kmp_sparse *sparse;
    bool analysed;
} klu;

static int setup(SUNLinearSolver s, SUNMatrix a)
{
    static const int meaning[] = {[KMP_SPARSE_FACTORED] = 0,
                                  [KMP_SPARSE_SINGULAR] = SUNLS_LUFACT_FAIL,
                                  [KMP_SPARSE_NO_MEMORY] = KMP_SUN_NO_MEMORY,
                                  [KMP_SPARSE_FAILED] = KMP_SUN_PACKAGE_FAILED};
    klu *k = s->content;
    k->analysed = k->analysed ||
                  kmp_sparse_take_columns(k->sparse, SUNSparseMatrix_IndexPointers(a), SUNSparseMatrix_IndexValues(a));
    k->head.last = k->analysed ? meaning[kmp_sparse_factor(k->sparse, SUNSparseMatrix_Data(a))] : KMP_SUN_NO_MEMORY;
    return k->head.last;
}

static int solve(SUNLinearSolver s, SUNMatrix a, N_Vector x, N_Vector b, sunrealtype tolerance)
{
    (void)tolerance;
    klu *k = s->content;
    double *out = kmp_sun_data(x);
    if (out != kmp_sun_data(b))
        memcpy(out, kmp_sun_data(b), (size_t)SUNSparseMatrix_Columns(a) * sizeof *out);
    return k->head.last = kmp_sparse_solve(k->sparse, 1, out) ? 0 : KMP_SUN_PACKAGE_FAILED;
}

static void release(void *content)
{
    klu *k = content;
    kmp_sparse_free(k->sparse);
    kmp_free(k);
}

SUNLinearSolver kmp_linear_klu(SUNMatrix a, SUNContext context)
{
    static const kmp_linear_ops ops = {setup, solve, release};
    klu *k = KMP_NEW(klu, 1);
    if (!k)
        return NULL;
    k->sparse = kmp_sparse_new_columns((int)SUNSparseMatrix_Columns(a), (int)SUNSparseMatrix_NNZ(a));
    if (k->sparse)
        return kmp_linear_wrap(&k->head, &ops, context);
    release(k);
    return NULL;
}
