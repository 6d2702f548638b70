/* SPDX-License-Identifier: BSD-3-Clause */
/* Hides SUNDIALS KINSOL (Hindmarsh et al., ACM TOMS 31 (2005) 363; line search of Dennis, Schnabel, Numerical
 * Methods for Unconstrained Optimization and Nonlinear Equations, A6.3.1): its objects and flags. The Jacobian
 * is evaluated in every iteration. */
#include "constraints/closing/kinsol.h"
#include "constraints/sundials_compat.h"
#include <kinsol/kinsol.h>
#include <string.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

enum { MAX_ITERATIONS = 200 };
static const double SMALLEST_STEP = 1e-15;

static int system_function(N_Vector x, N_Vector r, void *user)
{
    const kmp_kinsol_problem *p = user;
    return p->f(p->self, kmp_sun_data(x), kmp_sun_data(r));
}

static int jacobian(N_Vector x, N_Vector r, SUNMatrix a, void *user, N_Vector w1, N_Vector w2)
{
    const kmp_kinsol_problem *p = user;
    (void)r, (void)w1, (void)w2;
    return p->jac(p->self, kmp_sun_data(x), SUNDenseMatrix_Data(a));
}

/* Makes the vectors x, scale_x and scale_f. false: no memory. */
static bool make_vectors(const kmp_kinsol_problem *p, const double *x, SUNContext sun, N_Vector v[3])
{
    const double *from[3] = {x, p->scale_x, p->scale_f};
    bool made = sun;
    for (int k = 0; made && k < 3; k++) {
        v[k] = N_VNew_Serial(p->n, sun);
        made = v[k];
        if (made)
            memcpy(kmp_sun_data(v[k]), from[k], (size_t)p->n * sizeof *x);
    }
    return made;
}

static bool configure(const kmp_kinsol_problem *p, void *kinsol, N_Vector x, SUNLinearSolver solver, SUNMatrix matrix,
                      double ftol)
{
    KMP_SUN_QUIET(KINSetErrHandlerFn, kinsol);
    return !KINInit(kinsol, system_function, x) && !KINSetUserData(kinsol, (void *)p) &&
           !KINSetLinearSolver(kinsol, solver, matrix) && !KINSetJacFn(kinsol, jacobian) &&
           !KINSetFuncNormTol(kinsol, ftol) && !KINSetScaledStepTol(kinsol, SMALLEST_STEP) &&
           !KINSetMaxSetupCalls(kinsol, 1) && !KINSetNumMaxIters(kinsol, MAX_ITERATIONS);
}

bool kmp_kinsol_solve(const kmp_kinsol_problem *p, double ftol, double *x, int *iterations)
{
    SUNContext sun = kmp_sun_context();
    N_Vector v[3] = {NULL};
    bool made = make_vectors(p, x, sun, v);
    void *kinsol = made ? KINCreate(sun) : NULL;
    SUNMatrix matrix = made ? SUNDenseMatrix(p->n, p->n, sun) : NULL;
    SUNLinearSolver solver = matrix ? SUNLinSol_Dense(v[0], matrix, sun) : NULL;
    int flag = KIN_MEM_NULL;
    if (kinsol && solver && configure(p, kinsol, v[0], solver, matrix, ftol))
        flag = KINSol(kinsol, v[0], KIN_LINESEARCH, v[1], v[2]);
    bool found = flag == KIN_SUCCESS || flag == KIN_INITIAL_GUESS_OK;
    long count = 0;
    if (kinsol)
        (void)KINGetNumNonlinSolvIters(kinsol, &count);
    *iterations = (int)count;
    if (found)
        memcpy(x, kmp_sun_data(v[0]), (size_t)p->n * sizeof *x);
    if (solver)
        SUNLinSolFree(solver);
    if (matrix)
        SUNMatDestroy(matrix);
    KINFree(&kinsol);
    for (int k = 0; k < 3; k++)
        if (v[k])
            N_VDestroy(v[k]);
    if (sun)
        SUNContext_Free(&sun);
    return found;
}
