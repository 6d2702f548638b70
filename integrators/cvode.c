/* SPDX-License-Identifier: BSD-3-Clause */
/* SUNDIALS CVODE (Cohen and Hindmarsh, Computers in Physics 10 (1996) 138) behind the socket, as two integrators: BDF
 * with Newton, a dense factorisation and the road's exact Jacobian, for stiff systems; Adams with functional iteration,
 * for those that are not. It keeps a history of the solution: the road may watch
 * its steps and refuse them, at the price of a start at order 1, not correct them. */
#include "base/memory.h"
#include "integrators/sundials_ode.h"

#include <cvode/cvode.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

/* Attempts at one step that the road may refuse. */
enum { MAX_TRIES = 100 };

typedef struct cvode {
    kmp_sun_ode base; /* first */
    void *memory;
    SUNNonlinearSolver iteration; /* Adams */
    kmp_solver_work before;       /* of earlier starts: CVODE's counters begin anew with each */
} cvode;

/* -- creation -------------------------------------------------------------------------------------- */

static int configure(cvode *s, int method)
{
    KMP_SUN_QUIET(CVodeSetErrHandlerFn, s->memory);
    int bad = CVodeInit(s->memory, kmp_sun_rhs, 0.0, s->base.y);
    bad = bad ? bad : CVodeSetUserData(s->memory, s);
    bad = bad ? bad : CVodeSVtolerances(s->memory, s->base.tolerance.rtol, s->base.atol);
    bad = bad ? bad : CVodeSetMaxNumSteps(s->memory, -1);
    bad = bad ? bad : CVodeSetMaxHnilWarns(s->memory, -1);
    bad = bad ? bad : CVodeSetMaxErrTestFails(s->memory, 20);
    bad = bad ? bad : CVodeSetMaxConvFails(s->memory, 20);
    if (method == CV_ADAMS)
        return bad ? bad : CVodeSetNonlinearSolver(s->memory, s->iteration);
    bad = bad ? bad : CVodeSetLinearSolver(s->memory, s->base.linear, s->base.matrix);
    return bad || !s->base.ode.jacobian ? bad : CVodeSetJacFn(s->memory, kmp_sun_jacobian);
}

static void release(void *solver)
{
    cvode *s = solver;
    if (s->memory)
        CVodeFree(&s->memory);
    if (s->iteration)
        SUNNonlinSolFree(s->iteration);
    kmp_sun_ode_free(&s->base);
    kmp_free(s);
}

static void *create(const kmp_solver_setup *setup, int method)
{
    cvode *s = KMP_NEW(cvode, 1);
    bool ok = s && kmp_sun_ode_init(&s->base, setup, method == CV_BDF);
    if (ok && method == CV_ADAMS)
        ok = (s->iteration = SUNNonlinSol_FixedPoint(s->base.y, 0, s->base.sun)) != NULL;
    ok = ok && (s->memory = CVodeCreate(method, s->base.sun)) != NULL;
    int bad = ok ? configure(s, method) : 0;
    if (ok && !bad)
        return s;
    if (bad)
        (void)kmp_fail(setup->context, KEMPE_E_BUG, "CVODE refused its settings (flag %d)", bad);
    else
        (void)kmp_fail_memory(setup->context);
    if (s)
        release(s);
    return NULL;
}

static void *create_bdf(const kmp_solver_setup *setup)
{
    return create(setup, CV_BDF);
}

static void *create_adams(const kmp_solver_setup *setup)
{
    return create(setup, CV_ADAMS);
}

/* -- steps ----------------------------------------------------------------------------------------- */

static const char *meaning(int flag)
{
    switch (flag) {
    case CV_TOO_MUCH_ACC:
        return "the tolerance is finer than double precision can follow";
    case CV_ERR_FAILURE:
        return "the error test failed again and again down to the smallest step; the solution may not be smooth here";
    case CV_CONV_FAILURE:
        return "the iteration did not converge down to the smallest step";
    case CV_LSETUP_FAIL:
    case CV_LSOLVE_FAIL:
        return "the iteration matrix could not be factored";
    case CV_REPTD_RHSFUNC_ERR:
    case CV_FIRST_RHSFUNC_ERR:
    case CV_UNREC_RHSFUNC_ERR:
        return "the right-hand side could not be evaluated, even with the smallest step";
    case CV_MEM_FAIL:
        return "there is no memory";
    default:
        return "an unforeseen failure";
    }
}

static kempe_status complain(cvode *s, int flag)
{
    char *name = CVodeGetReturnFlagName(flag);
    kempe_status status = kmp_sun_complain(&s->base, "CVODE", meaning(flag), name);
    free(name);
    return status;
}

/* CVODE's own counters, over all starts. */
static kmp_solver_work counters(const cvode *s)
{
    kmp_solver_work w = {0};
    (void)CVodeGetNumSteps(s->memory, &w.steps);
    (void)CVodeGetNumErrTestFails(s->memory, &w.rejected);
    (void)CVodeGetNumNonlinSolvIters(s->memory, &w.newton);
    (void)CVodeGetNumStepSolveFails(s->memory, &w.refused);
    if (s->base.linear) {
        (void)CVodeGetNumJacEvals(s->memory, &w.matrices);
        (void)CVodeGetNumLinSolvSetups(s->memory, &w.factorizations);
    }
    return kmp_sun_sum(w, s->before);
}

static kmp_solver_work work(const void *solver)
{
    const cvode *s = solver;
    return kmp_sun_sum(counters(s), s->base.work);
}

static kempe_status start(void *solver, double t, const double *y, const double *yp, double t_end, double h0)
{
    cvode *s = solver;
    (void)yp;
    s->before = counters(s);
    kmp_sun_ode_begin(&s->base, t, y, t_end);
    int bad = CVodeReInit(s->memory, t, s->base.y);
    bad = bad ? bad : CVodeSetInitStep(s->memory, h0);
    bad = bad || !(t_end > t) ? bad : CVodeSetStopTime(s->memory, t_end);
    return bad ? complain(s, bad) : KEMPE_OK;
}

/* Back to the start of the last step, with a first step of half its length: the history is lost. */
static int retreat(cvode *s, double t)
{
    kmp_sun_ode *base = &s->base;
    double h = 0.5 * (t - base->t);
    s->before = counters(s);
    base->work.refused++;
    base->work.steps--;
    memcpy(kmp_sun_data(base->y), base->y_old, (size_t)base->ode.n * sizeof *base->y_old);
    int bad = CVodeReInit(s->memory, base->t, base->y);
    bad = bad ? bad : CVodeSetInitStep(s->memory, h);
    if (!(h > kmp_solver_least_step(base->t)))
        return CV_REPTD_RHSFUNC_ERR;
    return bad ? bad : CVodeSetStopTime(s->memory, base->t_end);
}

/* One step of CVODE and what the road says of it. */
static int attempt(cvode *s, double *t, int *said)
{
    kmp_sun_ode *base = &s->base;
    int flag = CVode(s->memory, base->t_end, base->y, t, CV_ONE_STEP);
    if (flag < 0)
        return flag;
    memcpy(kmp_sun_data(base->out), kmp_sun_data(base->y), (size_t)base->ode.n * sizeof *base->y_old);
    *said = kmp_sun_accept(base, *t, kmp_sun_data(base->out));
    return *said == KMP_HALT ? CV_UNREC_RHSFUNC_ERR : 0;
}

static kempe_status step(void *solver)
{
    cvode *s = solver;
    kmp_sun_ode *base = &s->base;
    int bad = 0, said = KMP_RETRY;
    double t = base->t;
    if (!(t < base->t_end))
        return KEMPE_OK;
    memcpy(base->y_old, kmp_sun_data(base->y), (size_t)base->ode.n * sizeof *base->y_old);
    for (int tries = 0; bad == 0 && tries < MAX_TRIES; tries++) {
        bad = attempt(s, &t, &said);
        if (bad == 0 && said == KMP_GO) {
            base->t_old = base->t;
            base->t = t;
            return kmp_sun_progress(base, "CVODE") ? KEMPE_OK : KEMPE_E_FAILED;
        }
        bad = bad ? bad : retreat(s, t);
    }
    return complain(s, bad ? bad : CV_REPTD_RHSFUNC_ERR);
}

static int into_out(void *solver, double t)
{
    cvode *s = solver;
    return CVodeGetDky(s->memory, t, 0, s->base.out);
}

static kempe_status dense(void *solver, double t, double *y, double *yp)
{
    (void)yp;
    return kmp_sun_dense(solver, "CVODE", t, y, into_out);
}

KMP_SUN_SOLVER(bdf, false, true);
KMP_SUN_SOLVER(adams, false, false);
