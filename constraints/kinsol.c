/* SPDX-License-Identifier: BSD-3-Clause */
/* Hides SUNDIALS KINSOL (Hindmarsh et al., ACM TOMS 31 (2005) 363; line search of Dennis, Schnabel, Numerical
 * Methods for Unconstrained Optimization and Nonlinear Equations, A6.3.1): its objects and flags. The Jacobian
 * is evaluated in every iteration. */
#include "constraints/kinsol.h"

#include "constraints/sundials_compat.h"

#include <kinsol/kinsol.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

enum { MAX_ITERATIONS = 200 };
static const double SMALLEST_STEP = 1e-15;

typedef struct problem {
    int (*f)(void *self, const double *x, double *r);
    int (*jac)(void *self, const double *x, double *a);
    void *self;
    SUNContext sun;
    void *memory;
    N_Vector x, scale_x, scale_f;
    SUNMatrix matrix;
    SUNLinearSolver solver;
} problem;

static int system_function(N_Vector x, N_Vector r, void *user)
{
    problem *p = user;
    return p->f(p->self, kmp_sun_data(x), kmp_sun_data(r));
}

static int jacobian(N_Vector x, N_Vector r, SUNMatrix a, void *user, N_Vector w1, N_Vector w2)
{
    (void)r;
    (void)w1;
    (void)w2;
    problem *p = user;
    return p->jac(p->self, kmp_sun_data(x), SUNDenseMatrix_Data(a));
}

static N_Vector vector_of(int n, const double *values, SUNContext sun)
{
    N_Vector v = N_VNew_Serial(n, sun);
    if (v)
        memcpy(kmp_sun_data(v), values, (size_t)n * sizeof *values);
    return v;
}

static bool make_parts(problem *p, int n, const double *x, const double *scale_x, const double *scale_f)
{
    p->sun = kmp_sun_context();
    if (!p->sun)
        return false;
    p->x = vector_of(n, x, p->sun);
    p->scale_x = vector_of(n, scale_x, p->sun);
    p->scale_f = vector_of(n, scale_f, p->sun);
    p->matrix = SUNDenseMatrix(n, n, p->sun);
    p->memory = KINCreate(p->sun);
    if (!p->x || !p->scale_x || !p->scale_f || !p->matrix || !p->memory)
        return false;
    p->solver = SUNLinSol_Dense(p->x, p->matrix, p->sun);
    return p->solver != NULL;
}

static void free_parts(problem *p)
{
    if (p->memory)
        KINFree(&p->memory);
    if (p->solver)
        SUNLinSolFree(p->solver);
    if (p->matrix)
        SUNMatDestroy(p->matrix);
    N_Vector vectors[] = {p->x, p->scale_x, p->scale_f};
    for (int i = 0; i < 3; i++)
        if (vectors[i])
            N_VDestroy(vectors[i]);
    if (p->sun)
        SUNContext_Free(&p->sun);
}

static int configure(problem *p, double ftol)
{
    KMP_SUN_QUIET(KINSetErrHandlerFn, p->memory);
    int bad = KINInit(p->memory, system_function, p->x);
    bad = bad ? bad : KINSetUserData(p->memory, p);
    bad = bad ? bad : KINSetLinearSolver(p->memory, p->solver, p->matrix);
    bad = bad ? bad : KINSetJacFn(p->memory, jacobian);
    bad = bad ? bad : KINSetFuncNormTol(p->memory, ftol);
    bad = bad ? bad : KINSetScaledStepTol(p->memory, SMALLEST_STEP);
    bad = bad ? bad : KINSetMaxSetupCalls(p->memory, 1);
    return bad ? bad : KINSetNumMaxIters(p->memory, MAX_ITERATIONS);
}

static const char *meaning(int flag)
{
    switch (flag) {
    case KIN_STEP_LT_STPTOL:
        return "the steps have become negligible";
    case KIN_LINESEARCH_NONCONV:
    case KIN_LINESEARCH_BCFAIL:
        return "no step along Newton's direction makes it smaller: a local minimum, not a solution";
    case KIN_MAXITER_REACHED:
        return "too many iterations";
    case KIN_MXNEWT_5X_EXCEEDED:
        return "five steps of the greatest length in a row: it runs away";
    case KIN_LINSOLV_NO_RECOVERY:
    case KIN_LSETUP_FAIL:
    case KIN_LSOLVE_FAIL:
        return "the Jacobian is singular or could not be evaluated";
    case KIN_SYSFUNC_FAIL:
    case KIN_FIRST_SYSFUNC_ERR:
    case KIN_REPTD_SYSFUNC_ERR:
        return "the equations could not be evaluated";
    case KIN_MEM_FAIL:
        return "there is no memory";
    default:
        return "an unforeseen failure";
    }
}

/* max |scale_f f(x)|; NaN when f cannot be evaluated. */
static double scaled_residual(problem *p, int n)
{
    double worst = 0.0, *scale = kmp_sun_data(p->scale_f);
    N_Vector r = N_VClone(p->x);
    if (!r || p->f(p->self, kmp_sun_data(p->x), kmp_sun_data(r)) != 0)
        worst = NAN;
    for (int i = 0; r && i < n; i++)
        worst = isnan(worst) ? worst : fmax(worst, fabs(scale[i] * kmp_sun_data(r)[i]));
    if (r)
        N_VDestroy(r);
    return worst;
}

static kempe_status run(kempe_context *context, problem *p, int n, double ftol, int *iterations)
{
    int flag = configure(p, ftol);
    if (flag)
        return kmp_fail(context, KEMPE_E_BUG, "KINSOL refused its settings (flag %d)", flag);
    flag = KINSol(p->memory, p->x, KIN_LINESEARCH, p->scale_x, p->scale_f);
    long count = 0;
    (void)KINGetNumNonlinSolvIters(p->memory, &count);
    *iterations = (int)count;
    if (flag == KIN_SUCCESS || flag == KIN_INITIAL_GUESS_OK)
        return KEMPE_OK;
    double left = scaled_residual(p, n);
    if (left <= ftol)
        return KEMPE_OK;
    return kmp_fail(context, KEMPE_E_FAILED,
                    "Newton with line search: residual %.2e (asked %.1e) after %ld iterations: %s", left, ftol, count,
                    meaning(flag));
}

kempe_status kmp_kinsol_solve(kempe_context *context, int n, double *x, const double *scale_x, const double *scale_f,
                              int (*f)(void *self, const double *x, double *r),
                              int (*jac)(void *self, const double *x, double *a), void *self, double ftol,
                              int *iterations)
{
    int done = 0;
    problem p = {.f = f, .jac = jac, .self = self};
    kempe_status status =
        make_parts(&p, n, x, scale_x, scale_f) ? run(context, &p, n, ftol, &done) : kmp_fail_memory(context);
    if (status == KEMPE_OK)
        memcpy(x, kmp_sun_data(p.x), (size_t)n * sizeof *x);
    if (iterations)
        *iterations = done;
    free_parts(&p);
    return status;
}
