/* SPDX-License-Identifier: BSD-3-Clause */
/* Hides UMFPACK (Davis, ACM TOMS 30 (2004) 196): one symbolic analysis, one numeric factorisation per setup, and solves
 * without iterative refinement in a separate workspace. */
#include "base/memory.h"
#include "integrators/sundials/linear.h"

#include <string.h>
#include <umfpack.h>

_Static_assert(sizeof(SuiteSparse_long) == sizeof(sunindextype), "SuiteSparse and SUNDIALS must agree on indices");

typedef struct umfpack {
    kmp_linear_head head; /* first */
    SuiteSparse_long n, *wi;
    void *symbolic, *numeric;
    double *w, *b;
    double control[UMFPACK_CONTROL];
} umfpack;

static SuiteSparse_long *columns(SUNMatrix a)
{
    return (SuiteSparse_long *)SUNSparseMatrix_IndexPointers(a);
}

static SuiteSparse_long *rows(SUNMatrix a)
{
    return (SuiteSparse_long *)SUNSparseMatrix_IndexValues(a);
}

static int meaning(SuiteSparse_long status)
{
    if (status == UMFPACK_OK)
        return 0;
    if (status == UMFPACK_WARNING_singular_matrix)
        return SUNLS_LUFACT_FAIL;
    return status == UMFPACK_ERROR_out_of_memory ? KMP_SUN_NO_MEMORY : KMP_SUN_PACKAGE_FAILED;
}

static int setup(SUNLinearSolver s, SUNMatrix a)
{
    umfpack *u = s->content;
    SuiteSparse_long status = UMFPACK_OK;
    if (!u->symbolic)
        status = umfpack_dl_symbolic(u->n, u->n, columns(a), rows(a), NULL, &u->symbolic, u->control, NULL);
    umfpack_dl_free_numeric(&u->numeric);
    if (status == UMFPACK_OK)
        status = umfpack_dl_numeric(columns(a), rows(a), SUNSparseMatrix_Data(a), u->symbolic, &u->numeric, u->control,
                                    NULL);
    return u->head.last = meaning(status);
}

/* UMFPACK needs separate x and b. */
static int solve(SUNLinearSolver s, SUNMatrix a, N_Vector x, N_Vector b, sunrealtype tolerance)
{
    (void)tolerance;
    umfpack *u = s->content;
    double *right = kmp_sun_data(b);
    if (!u->numeric)
        return u->head.last = KMP_SUN_PACKAGE_FAILED;
    if (right == kmp_sun_data(x))
        right = memcpy(u->b, right, (size_t)u->n * sizeof *right);
    SuiteSparse_long status = umfpack_dl_wsolve(UMFPACK_A, columns(a), rows(a), SUNSparseMatrix_Data(a),
                                                kmp_sun_data(x), right, u->numeric, u->control, NULL, u->wi, u->w);
    return u->head.last = meaning(status);
}

static void release(void *content)
{
    umfpack *u = content;
    umfpack_dl_free_numeric(&u->numeric);
    umfpack_dl_free_symbolic(&u->symbolic);
    kmp_free(u->wi);
    kmp_free(u->w);
    kmp_free(u->b);
    kmp_free(u);
}

SUNLinearSolver kmp_linear_umfpack(SUNMatrix a, SUNContext context)
{
    long n = SUNSparseMatrix_Columns(a);
    static const kmp_linear_ops ops = {setup, solve, release};
    umfpack *u = KMP_NEW(umfpack, 1);
    if (!u)
        return NULL;
    u->n = n;
    u->wi = KMP_NEW(SuiteSparse_long, n);
    u->w = KMP_NEW(double, n);
    u->b = KMP_NEW(double, n);
    umfpack_dl_defaults(u->control);
    u->control[UMFPACK_IRSTEP] = 0;
    if (u->wi && u->w && u->b)
        return kmp_linear_wrap(&u->head, &ops, context);
    release(u);
    return NULL;
}
