/* SPDX-License-Identifier: BSD-3-Clause */
/* Hides SUNDIALS IDA (Hindmarsh et al., ACM TOMS 31 (2005) 363): its vectors, matrix, callbacks and flags.
 * Settings that matter for multibody systems: error weights divided by `factor` (Newton tests every unknown, so
 * only the weight takes a multiplier out of it), algebraic unknowns out of the error test, a Newton tolerance
 * of 0.01, an explicit first step. IDA's own search for consistent values is not used. */
#include "base/memory.h"
#include "integrators/linear.h"
#include "integrators/sundials_ode.h"
#include "integrators/vector.h"

#include <ida/ida.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

static const double NEWTON_TOLERANCE = 0.01;
/* Attempts at one step that the road may refuse. */
enum { MAX_TRIES = 100 };

typedef struct ida {
    kempe_context *context;
    kmp_dae dae;
    kmp_tolerance tolerance;
    SUNContext sun;
    void *memory;
    N_Vector y, yp, differential, derivative;
    SUNMatrix matrix;
    SUNLinearSolver solver;
    double t, t_old, t_end;
    double *y_old, *yp_old; /* at the start of a step */
    int hopeless;           /* steps in a row that are hardly resolved */
    kmp_solver_work before; /* of earlier starts: IDA's counters begin anew with each */
} ida;

static SUNLinearSolver make_solver(ida *s, const char *name)
{
    SUNLinearSolver solver = kmp_linear_known(name) ? kmp_linear_new(name, s->matrix, s->sun) : NULL;
    if (!kmp_linear_known(name))
        (void)kmp_fail(s->context, KEMPE_E_ARGUMENT, "linear solver '%s': there is none of that name", name);
    else if (!solver)
        (void)kmp_fail_memory(s->context);
    return solver;
}

/* -- callbacks ------------------------------------------------------------------------------------- */

/* KMP_RETRY is IDA's recoverable failure (positive), KMP_HALT its fatal one (negative). */
static int residual(sunrealtype t, N_Vector y, N_Vector yp, N_Vector r, void *user)
{
    ida *s = user;
    return s->dae.residual(s->dae.self, t, kmp_sun_data(y), kmp_sun_data(yp), kmp_sun_data(r));
}

/* The pattern is written each time: IDA clears it with the values. */
static int jacobian(sunrealtype t, sunrealtype cj, N_Vector y, N_Vector yp, N_Vector r, SUNMatrix a, void *user,
                    N_Vector w1, N_Vector w2, N_Vector w3)
{
    (void)r;
    (void)w1;
    (void)w2;
    (void)w3;
    ida *s = user;
    const kmp_dae *dae = &s->dae;
    memcpy(SUNSparseMatrix_IndexPointers(a), dae->col_start, ((size_t)dae->n + 1) * sizeof *dae->col_start);
    memcpy(SUNSparseMatrix_IndexValues(a), dae->row, (size_t)dae->nz * sizeof *dae->row);
    return dae->matrix(dae->self, t, cj, kmp_sun_data(y), kmp_sun_data(yp), SUNSparseMatrix_Data(a));
}

static int weights(N_Vector y, N_Vector w, void *user)
{
    const ida *s = user;
    const double *value = kmp_sun_data(y), *atol = s->tolerance.atol, *factor = s->dae.factor, rtol = s->tolerance.rtol;
    double *restrict weight = kmp_sun_data(w);
    int bad = 0, n = s->dae.n; /* no jump, so that it goes in lanes */
    for (int i = 0; i < n; i++) {
        weight[i] = 1.0 / ((rtol * fabs(value[i]) + atol[i]) * factor[i]);
        bad |= !(weight[i] > 0.0);
    }
    return bad ? -1 : 0;
}

/* -- creation -------------------------------------------------------------------------------------- */

static bool make_parts(ida *s)
{
    const kmp_dae *dae = &s->dae;
    s->sun = kmp_sun_context();
    if (!s->sun)
        return false;
    s->y = kmp_vector_new(dae->n, s->sun);
    s->yp = kmp_vector_new(dae->n, s->sun);
    s->differential = kmp_vector_new(dae->n, s->sun);
    s->derivative = kmp_vector_new(dae->n, s->sun);
    s->matrix = SUNSparseMatrix(dae->n, dae->n, dae->nz, CSC_MAT, s->sun);
    s->memory = IDACreate(s->sun);
    s->y_old = KMP_NEW(double, dae->n);
    s->yp_old = KMP_NEW(double, dae->n);
    return s->y_old && s->yp_old && s->y && s->yp && s->differential && s->derivative && s->matrix && s->memory;
}

static int configure(ida *s)
{
    bool algebraic = false;
    for (int i = 0; i < s->dae.n; i++)
        algebraic = algebraic || s->dae.differential[i] == 0.0;
    memcpy(kmp_sun_data(s->differential), s->dae.differential, (size_t)s->dae.n * sizeof(double));
    N_VConst(0.0, s->y);
    N_VConst(0.0, s->yp);
    KMP_SUN_QUIET(IDASetErrHandlerFn, s->memory);
    int bad = IDAInit(s->memory, residual, 0.0, s->y, s->yp);
    bad = bad ? bad : IDASetUserData(s->memory, s);
    bad = bad ? bad : IDAWFtolerances(s->memory, weights);
    bad = bad ? bad : IDASetLinearSolver(s->memory, s->solver, s->matrix);
    bad = bad ? bad : IDASetJacFn(s->memory, jacobian);
    bad = bad ? bad : IDASetId(s->memory, s->differential);
    bad = bad ? bad : IDASetSuppressAlg(s->memory, algebraic);
    bad = bad ? bad : IDASetNonlinConvCoef(s->memory, NEWTON_TOLERANCE);
    bad = bad ? bad : IDASetMaxOrd(s->memory, 5);
    return bad ? bad : IDASetMaxNumSteps(s->memory, -1);
}

static void release(void *solver)
{
    ida *s = solver;
    if (s->memory)
        IDAFree(&s->memory);
    if (s->solver)
        SUNLinSolFree(s->solver);
    if (s->matrix)
        SUNMatDestroy(s->matrix);
    N_Vector vectors[] = {s->y, s->yp, s->differential, s->derivative};
    for (int i = 0; i < 4; i++)
        if (vectors[i])
            N_VDestroy(vectors[i]);
    if (s->sun)
        SUNContext_Free(&s->sun);
    kmp_free(s->y_old);
    kmp_free(s->yp_old);
    kmp_free(s);
}

static void *create(const kmp_solver_setup *setup)
{
    ida *s = KMP_NEW(ida, 1);
    if (!s) {
        (void)kmp_fail_memory(setup->context);
        return NULL;
    }
    s->context = setup->context;
    s->dae = *setup->dae;
    s->tolerance = setup->tolerance;
    if (!make_parts(s))
        (void)kmp_fail_memory(s->context);
    else if ((s->solver = make_solver(s, setup->linear)) != NULL) {
        int bad = configure(s);
        if (!bad)
            return s;
        (void)kmp_fail(s->context, KEMPE_E_BUG, "IDA refused its settings (flag %d)", bad);
    }
    release(s);
    return NULL;
}

/* -- steps ----------------------------------------------------------------------------------------- */

static const char *meaning(int flag)
{
    switch (flag) {
    case IDA_TOO_MUCH_ACC:
        return "the tolerance is finer than double precision can follow";
    case IDA_ERR_FAIL:
        return "the error test failed again and again down to the smallest step; the solution may not be smooth here";
    case IDA_CONV_FAIL:
        return "Newton's method did not converge down to the smallest step; the equations may be singular here";
    case IDA_LSETUP_FAIL:
    case IDA_LSOLVE_FAIL:
    case IDA_NLS_SETUP_FAIL:
        return "the iteration matrix could not be factored; the equations may be singular here";
    case IDA_RES_FAIL:
        return "the equations gave up";
    case IDA_REP_RES_ERR:
    case IDA_FIRST_RES_FAIL:
        return "the equations could not be evaluated, even with the smallest step";
    case IDA_BAD_EWT:
        return "an error weight is not positive: a tolerance is zero or a value is not finite";
    case IDA_ILL_INPUT:
        return "an input is not acceptable, or the end is too close to the start";
    case IDA_MEM_FAIL:
        return "there is no memory";
    default:
        return "an unforeseen failure";
    }
}

static kempe_status complain(ida *s, int flag)
{
    char *name = IDAGetReturnFlagName(flag);
    kempe_status status =
        kmp_fail(s->context, KEMPE_E_FAILED, "IDA stopped at t = %.9g: %s (%s)", s->t, meaning(flag), name);
    free(name);
    return status;
}

/* Over all starts. */
static kmp_solver_work work(const void *solver)
{
    const ida *s = solver;
    kmp_solver_work w = {0};
    (void)IDAGetNumSteps(s->memory, &w.steps);
    (void)IDAGetNumErrTestFails(s->memory, &w.rejected);
    (void)IDAGetNumResEvals(s->memory, &w.rhs);
    (void)IDAGetNumNonlinSolvIters(s->memory, &w.newton);
    (void)IDAGetNumJacEvals(s->memory, &w.matrices);
    (void)IDAGetNumLinSolvSetups(s->memory, &w.factorizations);
    (void)IDAGetNumNonlinSolvConvFails(s->memory, &w.refused);
    return kmp_sun_sum(w, s->before);
}

static kempe_status start(void *solver, double t, const double *y, const double *yp, double t_end, double h0)
{
    ida *s = solver;
    size_t size = (size_t)s->dae.n * sizeof(double);
    s->before = work(s);
    s->t = s->t_old = t;
    s->t_end = t_end;
    s->hopeless = 0;
    memcpy(kmp_sun_data(s->y), y, size);
    memcpy(kmp_sun_data(s->yp), yp, size);
    int bad = IDAReInit(s->memory, t, s->y, s->yp);
    bad = bad ? bad : IDASetInitStep(s->memory, h0);
    bad = bad || !(t_end > t) ? bad : IDASetStopTime(s->memory, t_end);
    return bad ? complain(s, bad) : KEMPE_OK;
}

/* Back to the start of the step that would have ended at t, for one of half its length: the history is lost. */
static int retreat(ida *s, double t)
{
    size_t size = (size_t)s->dae.n * sizeof(double);
    double h = 0.5 * (t - s->t);
    if (!(h > kmp_solver_least_step(s->t)))
        return IDA_REP_RES_ERR;
    s->before = work(s);
    s->before.refused++;
    s->before.steps--;
    memcpy(kmp_sun_data(s->y), s->y_old, size);
    memcpy(kmp_sun_data(s->yp), s->yp_old, size);
    int bad = IDAReInit(s->memory, s->t, s->y, s->yp);
    bad = bad ? bad : IDASetInitStep(s->memory, h);
    return bad ? bad : IDASetStopTime(s->memory, s->t_end);
}

/* One step of IDA and what the road says of it. A flag of IDA, 0 for none. */
static int attempt(ida *s, double *t, int *said)
{
    int flag = IDASolve(s->memory, s->t_end, t, s->y, s->yp, IDA_ONE_STEP);
    if (flag < 0)
        return flag;
    *said = s->dae.accept ? s->dae.accept(s->dae.self, *t, kmp_sun_data(s->y), kmp_sun_data(s->yp)) : KMP_GO;
    return *said == KMP_RETRY ? retreat(s, *t) : 0;
}

static kempe_status step(void *solver)
{
    ida *s = solver;
    size_t size = (size_t)s->dae.n * sizeof(double);
    int bad = 0, said = KMP_RETRY;
    double t = s->t;
    if (!(s->t < s->t_end))
        return KEMPE_OK;
    memcpy(s->y_old, kmp_sun_data(s->y), size);
    memcpy(s->yp_old, kmp_sun_data(s->yp), size);
    for (int tries = 0; said == KMP_RETRY && bad == 0; tries++)
        bad = tries < MAX_TRIES ? attempt(s, &t, &said) : IDA_REP_RES_ERR;
    if (bad)
        return complain(s, bad);
    s->t_old = s->t;
    s->t = t;
    if (said != KMP_GO)
        return KEMPE_E_FAILED;
    if (!kmp_solver_collapsed(&s->hopeless, s->t - s->t_old, s->t))
        return KEMPE_OK;
    return kmp_fail(s->context, KEMPE_E_FAILED, "IDA stopped at t = %.9g: " KMP_SOLVER_COLLAPSED, s->t);
}

static double t(const void *solver)
{
    return ((const ida *)solver)->t;
}

static double t_old(const void *solver)
{
    return ((const ida *)solver)->t_old;
}

/* -- dense output --------------------------------------------------------------------- */

static kempe_status dense(void *solver, double time, double *y, double *yp)
{
    ida *s = solver;
    size_t size = (size_t)s->dae.n * sizeof(double);
    double *out[2] = {y, yp};
    if (!(s->t > s->t_old) || time == s->t) { /* no step yet, or its end */
        memcpy(y, kmp_sun_data(s->y), size);
        memcpy(yp, kmp_sun_data(s->yp), size);
        return KEMPE_OK;
    }
    double slack = 1e-12 * (fabs(s->t) + s->t - s->t_old);
    bool outside = !(time >= s->t_old - slack && time <= s->t + slack);
    for (int k = 0; k < 2; k++) {
        int bad = outside ? IDA_BAD_T : IDAGetDky(s->memory, time, k, s->derivative);
        if (bad)
            return kmp_fail(s->context, KEMPE_E_BUG, "IDA has no value at t = %.9g: its last step is %.9g to %.9g",
                            time, s->t_old, s->t);
        memcpy(out[k], kmp_sun_data(s->derivative), size);
    }
    return KEMPE_OK;
}

const kmp_solver_kind kmp_solver_ida = {.name = "ida",
                                        .dae = true,
                                        .standard = true,
                                        .create = create,
                                        .release = release,
                                        .start = start,
                                        .step = step,
                                        .t = t,
                                        .t_old = t_old,
                                        .dense = dense,
                                        .work = work};
