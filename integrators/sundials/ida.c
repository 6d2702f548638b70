/* SPDX-License-Identifier: BSD-3-Clause */
/* SUNDIALS IDA (Hindmarsh et al., ACM TOMS 31 (2005) 363). Settings for multibody systems: error weights divided by
 * `factor`, algebraic unknowns excluded from the error test, a Newton tolerance of 0.01, an explicit first step. Newton
 * tests every unknown, so that only the weight excludes a multiplier. IDA's own search for consistent values is not
 * used. */
#include "integrators/sundials/sundials_host.h"

#include <ida/ida.h>
#include <math.h>
#include <string.h>
#include <sunmatrix/sunmatrix_sparse.h>

static const double NEWTON_TOLERANCE = 0.01;

/* -- callbacks ------------------------------------------------------------------------------------- */

/* KMP_RETRY is IDA's recoverable failure (positive), KMP_HALT its fatal one (negative). */
static int residual(sunrealtype t, N_Vector y, N_Vector yp, N_Vector r, void *user)
{
    const kmp_dae *dae = &((kmp_sun *)user)->base.dae;
    return dae->residual(dae->self, t, kmp_sun_data(y), kmp_sun_data(yp), kmp_sun_data(r));
}

/* The pattern is written each time: IDA clears it with the values. */
static int jacobian(sunrealtype t, sunrealtype cj, N_Vector y, N_Vector yp, N_Vector r, SUNMatrix a, void *user,
                    N_Vector w1, N_Vector w2, N_Vector w3)
{
    (void)r, (void)w1, (void)w2, (void)w3;
    const kmp_dae *dae = &((kmp_sun *)user)->base.dae;
    kmp_sun_put_pattern(dae, a);
    return dae->matrix(dae->self, t, cj, kmp_sun_data(y), kmp_sun_data(yp), SUNSparseMatrix_Data(a));
}

static int weights(N_Vector y, N_Vector w, void *user)
{
    const kmp_sun *s = user;
    const double *value = kmp_sun_data(y), *atol = s->base.tolerance.atol, *factor = s->base.dae.factor,
                 rtol = s->base.tolerance.rtol;
    double *restrict weight = kmp_sun_data(w);
    int bad = 0, n = s->n; /* no branch, so that the loop vectorises */
    for (int i = 0; i < n; i++) {
        weight[i] = 1.0 / ((rtol * fabs(value[i]) + atol[i]) * factor[i]);
        bad |= !(weight[i] > 0.0);
    }
    return bad ? -1 : 0;
}

/* -- the package ----------------------------------------------------------------------------------- */

static int configure(kmp_sun *s)
{
    static kmp_sun_counter *const counter[KMP_SUN_COUNTERS] = {
        IDAGetNumSteps,           IDAGetNumErrTestFails, IDAGetNumNonlinSolvConvFails, IDAGetNumResEvals,
        IDAGetNumNonlinSolvIters, IDAGetNumJacEvals,     IDAGetNumLinSolvSetups};
    bool algebraic = false;
    for (int i = 0; i < s->n; i++)
        algebraic = algebraic || s->base.dae.differential[i] == 0.0;
    memcpy(kmp_sun_data(s->out), s->base.dae.differential, (size_t)s->n * sizeof(double));
    s->counter = counter;
    s->memory = IDACreate(s->sun);
    if (!s->memory)
        return 0;
    KMP_SUN_QUIET(IDASetErrHandlerFn, s->memory);
    int bad = IDAInit(s->memory, residual, 0.0, s->y, s->yp);
    bad = bad ? bad : IDASetUserData(s->memory, s);
    bad = bad ? bad : IDAWFtolerances(s->memory, weights);
    bad = bad ? bad : IDASetLinearSolver(s->memory, s->linear, s->matrix);
    bad = bad ? bad : IDASetJacFn(s->memory, jacobian);
    bad = bad ? bad : IDASetId(s->memory, s->out);
    bad = bad ? bad : IDASetSuppressAlg(s->memory, algebraic);
    bad = bad ? bad : IDASetNonlinConvCoef(s->memory, NEWTON_TOLERANCE);
    bad = bad ? bad : IDASetMaxOrd(s->memory, 5);
    return bad ? bad : IDASetMaxNumSteps(s->memory, -1);
}

static int begin(kmp_sun *s, double t)
{
    return IDAReInit(s->memory, t, s->y, s->yp);
}

static int advance(kmp_sun *s, double *t)
{
    return IDASolve(s->memory, s->base.t_end, t, s->y, s->yp, IDA_ONE_STEP);
}

#define SINGULAR      "; the equations may be singular here"
#define NOT_FACTORED  KMP_SUN_NOT_FACTORED SINGULAR
#define NOT_EVALUATED "the equations could not be evaluated, even with the smallest step"

static const kmp_sun_flag flags[] = {
    {IDA_TOO_MUCH_ACC, KMP_SUN_TOO_FINE, false},
    {IDA_ERR_FAIL, KMP_SUN_NOT_SMOOTH, false},
    {IDA_CONV_FAIL, "Newton's method did not converge down to the smallest step" SINGULAR, false},
    {IDA_LSETUP_FAIL, NOT_FACTORED, false},
    {IDA_LSOLVE_FAIL, NOT_FACTORED, false},
    {IDA_NLS_SETUP_FAIL, NOT_FACTORED, false},
    {IDA_RES_FAIL, "the equations failed", false},
    {IDA_REP_RES_ERR, NOT_EVALUATED, false},
    {IDA_FIRST_RES_FAIL, NOT_EVALUATED, false},
    {IDA_BAD_EWT, "an error weight is not positive: a tolerance is zero or a value is not finite", false},
    {IDA_ILL_INPUT, "an input is not acceptable, or the end is too close to the start", false},
    {IDA_MEM_FAIL, KMP_SUN_OUT_OF_MEMORY, false},
    {0, NULL, false}};

static const kmp_sun_package package = {.name = "IDA",
                                        .flags = flags,
                                        .refused = IDA_REP_RES_ERR,
                                        .flag_name = IDAGetReturnFlagName,
                                        .release = IDAFree,
                                        .configure = configure,
                                        .begin = begin,
                                        .set_first_step = IDASetInitStep,
                                        .set_end = IDASetStopTime,
                                        .advance = advance,
                                        .derivative = IDAGetDky,
                                        .degree = IDAGetLastOrder};

const kmp_solver_kind kmp_solver_ida = {.name = "ida",
                                        .family = "bdf",
                                        .dae = true,
                                        .standard = true,
                                        .sparse = true,
                                        .stand_in = &kmp_solver_radau,
                                        .method = &package,
                                        KMP_SUN_FUNCTIONS};
