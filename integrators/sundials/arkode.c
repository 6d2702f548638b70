/* SPDX-License-Identifier: BSD-3-Clause */
/* SUNDIALS ARKODE (Reynolds et al., ACM TOMS 49 (2023) 19) as two integrators. `erk`: Dormand and Prince's explicit
 * pair 5(4), whose steps the formulation may correct (the state is reset). `dirk`: Kennedy and Carpenter's stiffly
 * accurate ESDIRK4(3)6L[2]SA (NASA/TM-2016-219173) with the formulation's exact Jacobian. ARKODE gives up when an
 * explicit right-hand side fails: the step is then repeated from its start with a quarter of its length. A reset
 * discards the interpolant, and is therefore delayed until the next step. */
#include "integrators/sundials/sundials_host.h"

#include <arkode/arkode_arkstep.h>

static int configure(kmp_sun *s)
{
    static kmp_sun_counter *const counter_explicit[KMP_SUN_COUNTERS] = {KMP_SUN_ARK(GetNumSteps),
                                                                        KMP_SUN_ARK(GetNumErrTestFails)};
    static kmp_sun_counter *const counter_implicit[KMP_SUN_COUNTERS] = {
        KMP_SUN_ARK(GetNumSteps),           KMP_SUN_ARK(GetNumErrTestFails), KMP_SUN_ARK(GetNumStepSolveFails), NULL,
        KMP_SUN_ARK(GetNumNonlinSolvIters), KMP_SUN_ARK(GetNumJacEvals),     KMP_SUN_ARK(GetNumLinSolvSetups)};
    s->counter = s->linear ? counter_implicit : counter_explicit;
    s->memory = ARKStepCreate(s->linear ? NULL : kmp_sun_rhs, s->linear ? kmp_sun_rhs : NULL, 0.0, s->y, s->sun);
    if (!s->memory)
        return 0;
    KMP_SUN_QUIET(ARKStepSetErrHandlerFn, s->memory);
    int bad = KMP_SUN_ARK(SetUserData)(s->memory, s);
    bad = bad ? bad : KMP_SUN_ARK(SVtolerances)(s->memory, s->base.tolerance.rtol, kmp_sun_atol(s));
    bad = bad ? bad : KMP_SUN_ARK(SetMaxNumSteps)(s->memory, -1);
    bad = bad ? bad : KMP_SUN_ARK(SetMaxHnilWarns)(s->memory, -1);
    bad = bad ? bad : KMP_SUN_ARK(SetMaxErrTestFails)(s->memory, 20);
    bad = bad ? bad : KMP_SUN_ARK(SetMaxConvFails)(s->memory, 20);
    bad = bad ? bad : kmp_sun_control_steps(s->memory, s->sun, &s->controller);
    if (!s->linear)
        return bad ? bad : ARKStepSetTableNum(s->memory, ARKODE_DIRK_NONE, ARKODE_DORMAND_PRINCE_7_4_5);
    /* Stage derivatives are taken from the stages: evaluated on a stiff system they would contain Newton's remainder
     * multiplied by the stiffness. The interpolant is Hermite's: Lagrange's needs a history and is linear in the first
     * step after a start, where events are located. The iteration matrix is computed in each step. An old one, in
     * particular from before an event, leaves remainders that these derivatives multiply by 1/h, and costs more steps
     * than it saves. */
    bad = bad ? bad : KMP_SUN_ARK(SetLinearSolver)(s->memory, s->linear, s->matrix);
    if (!bad && s->base.ode.jacobian)
        bad = KMP_SUN_ARK(SetJacFn)(s->memory, kmp_sun_jacobian);
    bad = bad ? bad : ARKStepSetTableNum(s->memory, ARKODE_ESDIRK436L2SA_6_3_4, ARKODE_ERK_NONE);
    bad = bad ? bad : KMP_SUN_ARK(SetInterpolantDegree)(s->memory, 3);
    bad = bad ? bad : KMP_SUN_ARK(SetLSetupFrequency)(s->memory, 1);
    bad = bad ? bad : KMP_SUN_ARK(SetJacEvalFrequency)(s->memory, 1);
    return bad ? bad : KMP_SUN_ARK(SetDeduceImplicitRhs)(s->memory, 1);
}

static int begin(kmp_sun *s, double t)
{
    return ARKStepReInit(s->memory, s->linear ? NULL : kmp_sun_rhs, s->linear ? kmp_sun_rhs : NULL, t, s->y);
}

static int advance(kmp_sun *s, double *t)
{
    return KMP_SUN_ARK(Evolve)(s->memory, s->base.t_end, s->y, t, ARK_ONE_STEP);
}

static const kmp_sun_flag flags[] = {{ARK_RHSFUNC_FAIL, KMP_SUN_NOT_EVALUATED, true},
                                     KMP_SUN_ODE_FLAGS(ARK, "Newton's method did not converge", true)};

static const kmp_sun_package package = {.name = "ARKODE",
                                        .flags = flags,
                                        .refused = ARK_RHSFUNC_FAIL,
                                        .flag_name = KMP_SUN_ARK(GetReturnFlagName),
                                        .release = KMP_SUN_ARK(Free),
                                        .configure = configure,
                                        .begin = begin,
                                        .reset = KMP_SUN_ARK(Reset),
                                        .set_first_step = KMP_SUN_ARK(SetInitStep),
                                        .set_end = KMP_SUN_ARK(SetStopTime),
                                        .planned = KMP_SUN_ARK(GetCurrentStep),
                                        .advance = advance,
                                        .derivative = KMP_SUN_ARK(GetDky)};

const kmp_solver_kind kmp_solver_erk = {
    .name = "erk", .corrects = true, .method = &package, .undo = kmp_sun_undo, KMP_SUN_FUNCTIONS};
const kmp_solver_kind kmp_solver_dirk = {.name = "dirk",
                                         .implicit = true,
                                         .method = &package,
                                         .undo = kmp_sun_undo,
                                         .repeats = KMP_REPEATED_ALL,
                                         KMP_SUN_FUNCTIONS};
