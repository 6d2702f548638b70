/* SPDX-License-Identifier: BSD-3-Clause */
/* Hides KLU (Davis and Palamadai Natarajan, ACM TOMS 37 (2010) 36): one analysis, one factorisation with pivoting;
 * after that refactorisations with the same pivots, until their growth says that the pivots no longer suit. */
#include "base/memory.h"
#include "integrators/linear.h"

#include <klu.h>
#include <stdbool.h>
#include <string.h>

/* A refactorisation whose reciprocal pivot growth is below this fraction of the last pivoted one's is not kept. */
#define GROWTH_KEPT 1e-3
/* Beyond this size the block-triangular form is left out: its matching takes n^2 in long chains, whose iteration matrix
 * is one block. */
enum { BLOCKS_UP_TO = 4000 };

typedef struct klu {
    kmp_linear_head head; /* first */
    long n;
    klu_l_common common;
    klu_l_symbolic *symbolic;
    klu_l_numeric *numeric;
    double growth; /* reciprocal, of the last factorisation with pivoting */
    bool good;     /* the factors are those of the last matrix */
} klu;

static int meaning(const klu *k)
{
    if (k->common.status == KLU_SINGULAR)
        return SUNLS_LUFACT_FAIL;
    return k->common.status == KLU_OUT_OF_MEMORY ? KMP_SUN_NO_MEMORY : KMP_SUN_PACKAGE_FAILED;
}

/* In common.rgrowth. */
static bool measure_growth(klu *k, SUNMatrix a)
{
    return klu_l_rgrowth(SUNSparseMatrix_IndexPointers(a), SUNSparseMatrix_IndexValues(a), SUNSparseMatrix_Data(a),
                         k->symbolic, k->numeric, &k->common);
}

/* With the pivots at hand; false when they do not suit. */
static bool refactor(klu *k, SUNMatrix a)
{
    return k->numeric &&
           klu_l_refactor(SUNSparseMatrix_IndexPointers(a), SUNSparseMatrix_IndexValues(a), SUNSparseMatrix_Data(a),
                          k->symbolic, k->numeric, &k->common) &&
           k->common.status == KLU_OK && measure_growth(k, a) && k->common.rgrowth >= GROWTH_KEPT * k->growth;
}

static bool factor(klu *k, SUNMatrix a)
{
    long *start = SUNSparseMatrix_IndexPointers(a), *row = SUNSparseMatrix_IndexValues(a);
    klu_l_free_numeric(&k->numeric, &k->common);
    if (!k->symbolic)
        k->symbolic = klu_l_analyze(k->n, start, row, &k->common);
    if (k->symbolic)
        k->numeric = klu_l_factor(start, row, SUNSparseMatrix_Data(a), k->symbolic, &k->common);
    bool ok = k->numeric && k->common.status == KLU_OK && measure_growth(k, a);
    k->growth = ok ? k->common.rgrowth : 0;
    return ok;
}

static int setup(SUNLinearSolver s, SUNMatrix a)
{
    klu *k = s->content;
    k->good = refactor(k, a) || factor(k, a);
    if (!k->good)
        klu_l_free_numeric(&k->numeric, &k->common);
    return k->head.last = k->good ? 0 : meaning(k);
}

static int solve(SUNLinearSolver s, SUNMatrix a, N_Vector x, N_Vector b, sunrealtype tolerance)
{
    (void)a;
    (void)tolerance;
    klu *k = s->content;
    double *out = kmp_sun_data(x);
    if (!k->good)
        return k->head.last = KMP_SUN_PACKAGE_FAILED;
    if (out != kmp_sun_data(b))
        memcpy(out, kmp_sun_data(b), (size_t)k->n * sizeof *out);
    bool ok = klu_l_solve(k->symbolic, k->numeric, k->n, 1, out, &k->common);
    return k->head.last = ok ? 0 : KMP_SUN_PACKAGE_FAILED;
}

static void release(void *content)
{
    klu *k = content;
    klu_l_free_numeric(&k->numeric, &k->common);
    klu_l_free_symbolic(&k->symbolic, &k->common);
    kmp_free(k);
}

SUNLinearSolver kmp_linear_klu(long n, SUNContext context)
{
    static const kmp_linear_ops ops = {setup, solve, release};
    klu *k = KMP_NEW(klu, 1);
    if (!k)
        return NULL;
    k->n = n;
    klu_l_defaults(&k->common);
    k->common.btf = n <= BLOCKS_UP_TO;
    return kmp_linear_wrap(&k->head, &ops, context);
}
