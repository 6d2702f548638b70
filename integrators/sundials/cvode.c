/* SPDX-License-Identifier: BSD-3-Clause */
/* SUNDIALS CVODE (Cohen and Hindmarsh, Computers in Physics 10 (1996) 138) as two integrators. BDF with Newton, a dense
 * factorisation and the formulation's exact Jacobian is for stiff systems; Adams with functional iteration is for
 * others. CVODE keeps a history of the solution. The formulation may reject its steps, which restarts CVODE at order 1;
 * it must not correct them. */
#include "integrators/sundials/sundials_host.h"

#include <cvode/cvode.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

static int configure(kmp_sun *s)
{
    static kmp_sun_counter *const counter[KMP_SUN_COUNTERS] = {
        CVodeGetNumSteps,           CVodeGetNumErrTestFails, CVodeGetNumStepSolveFails, NULL,
        CVodeGetNumNonlinSolvIters, CVodeGetNumJacEvals,     CVodeGetNumLinSolvSetups};
    s->counter = counter;
    s->iteration = s->linear ? NULL : SUNNonlinSol_FixedPoint(s->y, 0, s->sun);
    s->memory = s->linear || s->iteration ? CVodeCreate(s->linear ? CV_BDF : CV_ADAMS, s->sun) : NULL;
    if (!s->memory)
        return 0;
    KMP_SUN_QUIET(CVodeSetErrHandlerFn, s->memory);
    int bad = CVodeInit(s->memory, kmp_sun_rhs, 0.0, s->y);
    bad = bad ? bad : CVodeSetUserData(s->memory, s);
    bad = bad ? bad : CVodeSVtolerances(s->memory, s->base.tolerance.rtol, kmp_sun_atol(s));
    bad = bad ? bad : CVodeSetMaxNumSteps(s->memory, -1);
    bad = bad ? bad : CVodeSetMaxHnilWarns(s->memory, -1);
    bad = bad ? bad : CVodeSetMaxErrTestFails(s->memory, 20);
    bad = bad ? bad : CVodeSetMaxConvFails(s->memory, 20);
    if (!s->linear)
        return bad ? bad : CVodeSetNonlinearSolver(s->memory, s->iteration);
    bad = bad ? bad : CVodeSetLinearSolver(s->memory, s->linear, s->matrix);
    return bad || !s->base.ode.jacobian ? bad : CVodeSetJacFn(s->memory, kmp_sun_jacobian);
}

static int begin(kmp_sun *s, double t)
{
    return CVodeReInit(s->memory, t, s->y);
}

static int advance(kmp_sun *s, double *t)
{
    return CVode(s->memory, s->base.t_end, s->y, t, CV_ONE_STEP);
}

static const kmp_sun_flag flags[] = {KMP_SUN_ODE_FLAGS(CV, "the iteration did not converge", false)};

static const kmp_sun_package package = {.name = "CVODE",
                                        .flags = flags,
                                        .refused = CV_REPTD_RHSFUNC_ERR,
                                        .flag_name = CVodeGetReturnFlagName,
                                        .release = CVodeFree,
                                        .configure = configure,
                                        .begin = begin,
                                        .set_first_step = CVodeSetInitStep,
                                        .set_end = CVodeSetStopTime,
                                        .advance = advance,
                                        .derivative = CVodeGetDky,
                                        .degree = CVodeGetLastOrder};

const kmp_solver_kind kmp_solver_bdf = {.name = "bdf",
                                        .family = "bdf",
                                        .implicit = true,
                                        .stand_in = &kmp_solver_radau,
                                        .method = &package,
                                        KMP_SUN_FUNCTIONS};
const kmp_solver_kind kmp_solver_adams = {
    .name = "adams", .stand_in = &kmp_solver_dop853, .method = &package, KMP_SUN_FUNCTIONS};
