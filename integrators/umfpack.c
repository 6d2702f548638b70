/* SPDX-License-Identifier: BSD-3-Clause */
/* Hides UMFPACK (Davis, ACM TOMS 30 (2004) 196) behind SUNDIALS's interface: one symbolic analysis, a numeric
 * factorisation a setup, a solve without iterative refinement in own workspace. A singular matrix is told as a
 * recoverable failure, so that the integrator tries a smaller step. */
#include "integrators/umfpack.h"

#include "base/memory.h"

#include <string.h>
#include <sunmatrix/sunmatrix_sparse.h>
#include <umfpack.h>

_Static_assert(sizeof(SuiteSparse_long) == sizeof(sunindextype), "SuiteSparse and SUNDIALS must agree on indices");

typedef struct umfpack {
    SuiteSparse_long n, *wi;
    void *symbolic, *numeric;
    double *w, *b;
    double control[UMFPACK_CONTROL];
    int last;
} umfpack;

static umfpack *content(SUNLinearSolver s)
{
    return s->content;
}

static SuiteSparse_long *columns(SUNMatrix a)
{
    return (SuiteSparse_long *)SUNSparseMatrix_IndexPointers(a);
}

static SuiteSparse_long *rows(SUNMatrix a)
{
    return (SuiteSparse_long *)SUNSparseMatrix_IndexValues(a);
}

static SUNLinearSolver_Type type(SUNLinearSolver s)
{
    (void)s;
    return SUNLINEARSOLVER_DIRECT;
}

static SUNLinearSolver_ID id(SUNLinearSolver s)
{
    (void)s;
    return SUNLINEARSOLVER_CUSTOM;
}

static int initialize(SUNLinearSolver s)
{
    return content(s)->last = SUNLS_SUCCESS;
}

static int meaning(SuiteSparse_long status)
{
    if (status == UMFPACK_OK)
        return SUNLS_SUCCESS;
    if (status == UMFPACK_WARNING_singular_matrix)
        return SUNLS_LUFACT_FAIL;
    return status == UMFPACK_ERROR_out_of_memory ? SUNLS_MEM_FAIL : SUNLS_PACKAGE_FAIL_UNREC;
}

static int setup(SUNLinearSolver s, SUNMatrix a)
{
    umfpack *u = content(s);
    SuiteSparse_long status = UMFPACK_OK;
    if (!u->symbolic)
        status = umfpack_dl_symbolic(u->n, u->n, columns(a), rows(a), NULL, &u->symbolic, u->control, NULL);
    umfpack_dl_free_numeric(&u->numeric);
    if (status == UMFPACK_OK)
        status = umfpack_dl_numeric(columns(a), rows(a), SUNSparseMatrix_Data(a), u->symbolic, &u->numeric, u->control,
                                    NULL);
    return u->last = meaning(status);
}

/* UMFPACK wants x and b apart. */
static int solve(SUNLinearSolver s, SUNMatrix a, N_Vector x, N_Vector b, sunrealtype tolerance)
{
    (void)tolerance;
    umfpack *u = content(s);
    double *right = kmp_sun_data(b);
    if (!u->numeric)
        return u->last = SUNLS_MEM_NULL;
    if (right == kmp_sun_data(x))
        right = memcpy(u->b, right, (size_t)u->n * sizeof *right);
    SuiteSparse_long status = umfpack_dl_wsolve(UMFPACK_A, columns(a), rows(a), SUNSparseMatrix_Data(a),
                                                kmp_sun_data(x), right, u->numeric, u->control, NULL, u->wi, u->w);
    return u->last = meaning(status);
}

static sunindextype last_flag(SUNLinearSolver s)
{
    return content(s)->last;
}

static void free_content(umfpack *u)
{
    if (!u)
        return;
    umfpack_dl_free_numeric(&u->numeric);
    umfpack_dl_free_symbolic(&u->symbolic);
    kmp_free(u->wi);
    kmp_free(u->w);
    kmp_free(u->b);
    kmp_free(u);
}

static int free_solver(SUNLinearSolver s)
{
    free_content(s->content);
    s->content = NULL;
    SUNLinSolFreeEmpty(s);
    return SUNLS_SUCCESS;
}

static umfpack *new_content(long n)
{
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
        return u;
    free_content(u);
    return NULL;
}

SUNLinearSolver kmp_umfpack_solver(long n, SUNContext context)
{
    umfpack *u = new_content(n);
    SUNLinearSolver s = u ? SUNLinSolNewEmpty(context) : NULL;
    if (!s) {
        free_content(u);
        return NULL;
    }
    s->content = u;
    s->ops->gettype = type;
    s->ops->getid = id;
    s->ops->initialize = initialize;
    s->ops->setup = setup;
    s->ops->solve = solve;
    s->ops->lastflag = last_flag;
    s->ops->free = free_solver;
    return s;
}
