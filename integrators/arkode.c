/* SPDX-License-Identifier: BSD-3-Clause */
/* SUNDIALS ARKODE (Reynolds et al., ACM TOMS 49 (2023) 19) behind the socket, as two integrators: `erk`, Dormand and
 * Prince's explicit pair 5(4), which lets the road correct its steps (the state is reset); `dirk`, Kennedy
 * and Carpenter's stiffly accurate ESDIRK4(3)6L[2]SA (NASA/TM-2016-219173) with the road's exact Jacobian. ARKODE gives
 * up when an explicit right-hand side fails: the step is then begun anew from its start with a quarter of its length. A
 * reset, which forgets the interpolant, is put off until the next step. */
#include "base/memory.h"
#include "integrators/sundials_ode.h"

#include <arkode/arkode_arkstep.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Attempts at one step that may be shortened. */
enum { MAX_TRIES = 100 };

typedef struct arkode {
    kmp_sun_ode base; /* first */
    void *memory;
    bool implicit;
    bool moved;             /* the road has corrected y: reset before the next step */
    kmp_solver_work before; /* of earlier starts: ARKODE's counters begin anew with each */
} arkode;

/* -- creation -------------------------------------------------------------------------------------- */

/* Stage derivatives are taken from the stages: evaluated on a stiff system they would carry Newton's rest multiplied by
 * the stiffness. The interpolant is Hermite's: Lagrange's needs a history and is linear in the first step after a
 * start, where events are located. The iteration matrix is made anew each step: an old one, worst that of before an
 * event, leaves rests that these derivatives multiply by 1/h, and costs more steps than it saves. */
static int configure_implicit(arkode *s)
{
    int bad = KMP_SUN_ARK(SetLinearSolver)(s->memory, s->base.linear, s->base.matrix);
    if (!bad && s->base.ode.jacobian)
        bad = KMP_SUN_ARK(SetJacFn)(s->memory, kmp_sun_jacobian);
    bad = bad ? bad : ARKStepSetTableNum(s->memory, ARKODE_ESDIRK436L2SA_6_3_4, ARKODE_ERK_NONE);
    bad = bad ? bad : KMP_SUN_ARK(SetInterpolantDegree)(s->memory, 3);
    bad = bad ? bad : KMP_SUN_ARK(SetLSetupFrequency)(s->memory, 1);
    bad = bad ? bad : KMP_SUN_ARK(SetJacEvalFrequency)(s->memory, 1);
    return bad ? bad : KMP_SUN_ARK(SetDeduceImplicitRhs)(s->memory, 1);
}

static int configure(arkode *s)
{
    KMP_SUN_QUIET(ARKStepSetErrHandlerFn, s->memory);
    int bad = KMP_SUN_ARK(SetUserData)(s->memory, s);
    bad = bad ? bad : KMP_SUN_ARK(SVtolerances)(s->memory, s->base.tolerance.rtol, s->base.atol);
    bad = bad ? bad : KMP_SUN_ARK(SetMaxNumSteps)(s->memory, -1);
    bad = bad ? bad : KMP_SUN_ARK(SetMaxHnilWarns)(s->memory, -1);
    bad = bad ? bad : KMP_SUN_ARK(SetMaxErrTestFails)(s->memory, 20);
    bad = bad ? bad : KMP_SUN_ARK(SetMaxConvFails)(s->memory, 20);
    if (s->implicit)
        return bad ? bad : configure_implicit(s);
    return bad ? bad : ARKStepSetTableNum(s->memory, ARKODE_DIRK_NONE, ARKODE_DORMAND_PRINCE_7_4_5);
}

static void release(void *solver)
{
    arkode *s = solver;
    if (s->memory)
        KMP_SUN_ARK(Free)(&s->memory);
    kmp_sun_ode_free(&s->base);
    kmp_free(s);
}

static void *create(const kmp_solver_setup *setup, bool implicit)
{
    arkode *s = KMP_NEW(arkode, 1);
    bool ok = s && kmp_sun_ode_init(&s->base, setup, implicit);
    if (ok) {
        s->implicit = implicit;
        s->memory =
            ARKStepCreate(implicit ? NULL : kmp_sun_rhs, implicit ? kmp_sun_rhs : NULL, 0.0, s->base.y, s->base.sun);
    }
    ok = ok && s->memory;
    int bad = ok ? configure(s) : 0;
    if (ok && !bad)
        return s;
    if (bad)
        (void)kmp_fail(setup->context, KEMPE_E_BUG, "ARKODE refused its settings (flag %d)", bad);
    else
        (void)kmp_fail_memory(setup->context);
    if (s)
        release(s);
    return NULL;
}

static void *create_erk(const kmp_solver_setup *setup)
{
    return create(setup, false);
}

static void *create_dirk(const kmp_solver_setup *setup)
{
    return create(setup, true);
}

/* -- failures and counters ------------------------------------------------------------------------- */

static bool cannot_evaluate(int flag)
{
    return flag == ARK_RHSFUNC_FAIL || flag == ARK_FIRST_RHSFUNC_ERR || flag == ARK_REPTD_RHSFUNC_ERR ||
           flag == ARK_UNREC_RHSFUNC_ERR;
}

static const char *meaning(int flag)
{
    if (cannot_evaluate(flag))
        return "the right-hand side could not be evaluated, even with the smallest step";
    switch (flag) {
    case ARK_TOO_MUCH_ACC:
        return "the tolerance is finer than double precision can follow";
    case ARK_ERR_FAILURE:
        return "the error test failed again and again down to the smallest step; the solution may not be smooth here";
    case ARK_CONV_FAILURE:
        return "Newton's method did not converge down to the smallest step";
    case ARK_LSETUP_FAIL:
    case ARK_LSOLVE_FAIL:
        return "the iteration matrix could not be factored";
    case ARK_MEM_FAIL:
        return "there is no memory";
    default:
        return "an unforeseen failure";
    }
}

static kempe_status complain(arkode *s, int flag)
{
    char *name = KMP_SUN_ARK(GetReturnFlagName)(flag);
    kempe_status status = kmp_sun_complain(&s->base, "ARKODE", meaning(flag), name);
    free(name);
    return status;
}

/* ARKODE's own counters, over all starts. */
static kmp_solver_work counters(const arkode *s)
{
    kmp_solver_work w = {0};
    (void)KMP_SUN_ARK(GetNumSteps)(s->memory, &w.steps);
    (void)KMP_SUN_ARK(GetNumErrTestFails)(s->memory, &w.rejected);
    if (s->implicit) {
        (void)KMP_SUN_ARK(GetNumNonlinSolvIters)(s->memory, &w.newton);
        (void)KMP_SUN_ARK(GetNumStepSolveFails)(s->memory, &w.refused);
        (void)KMP_SUN_ARK(GetNumJacEvals)(s->memory, &w.matrices);
        (void)KMP_SUN_ARK(GetNumLinSolvSetups)(s->memory, &w.factorizations);
    }
    return kmp_sun_sum(w, s->before);
}

static kmp_solver_work work(const void *solver)
{
    const arkode *s = solver;
    return kmp_sun_sum(counters(s), s->base.work);
}

/* -- steps ----------------------------------------------------------------------------------------- */

static kempe_status start(void *solver, double t, const double *y, const double *yp, double t_end, double h0)
{
    arkode *s = solver;
    (void)yp;
    s->before = counters(s);
    s->moved = false;
    kmp_sun_ode_begin(&s->base, t, y, t_end);
    int bad =
        ARKStepReInit(s->memory, s->implicit ? NULL : kmp_sun_rhs, s->implicit ? kmp_sun_rhs : NULL, t, s->base.y);
    bad = bad ? bad : KMP_SUN_ARK(SetInitStep)(s->memory, h0);
    bad = bad || !(t_end > t) ? bad : KMP_SUN_ARK(SetStopTime)(s->memory, t_end);
    return bad ? complain(s, bad) : KEMPE_OK;
}

/* From (t, y) on, as a one-step method may; h > 0 is the next step. */
static int reset(arkode *s, double t, const double *y, double h)
{
    memcpy(kmp_sun_data(s->base.y), y, (size_t)s->base.ode.n * sizeof *y);
    int bad = KMP_SUN_ARK(Reset)(s->memory, t, s->base.y);
    if (!bad && h > 0)
        bad = KMP_SUN_ARK(SetInitStep)(s->memory, h);
    return bad ? bad : KMP_SUN_ARK(SetStopTime)(s->memory, s->base.t_end);
}

/* The length that was about to be tried. */
static double planned(arkode *s)
{
    double h = 0, left = s->base.t_end - s->base.t;
    (void)KMP_SUN_ARK(GetCurrentStep)(s->memory, &h);
    return h > 0 ? fmin(h, left) : 1e-3 * left;
}

/* One attempt of length h or so: ARK_SUCCESS with the new (t, out), 1 to try a shorter one, negative to give up. */
static int attempt(arkode *s, double *t, double *shorter)
{
    kmp_sun_ode *base = &s->base;
    int flag = KMP_SUN_ARK(Evolve)(s->memory, base->t_end, base->y, t, ARK_ONE_STEP);
    if (flag < 0) {
        *shorter = 0.25;
        return cannot_evaluate(flag) && !base->halted ? 1 : flag;
    }
    memcpy(kmp_sun_data(base->out), kmp_sun_data(base->y), (size_t)base->ode.n * sizeof(double));
    int said = kmp_sun_accept(base, *t, kmp_sun_data(base->out));
    *shorter = 0.5;
    return said == KMP_GO ? 0 : said == KMP_RETRY ? 1 : ARK_UNRECOGNIZED_ERROR;
}

/* The step that was made, with the road's corrections. */
static void take(arkode *s, double t)
{
    kmp_sun_ode *base = &s->base;
    size_t size = (size_t)base->ode.n * sizeof(double);
    s->moved = memcmp(kmp_sun_data(base->y), kmp_sun_data(base->out), size) != 0;
    memcpy(kmp_sun_data(base->y), kmp_sun_data(base->out), size);
    base->t_old = base->t;
    base->t = t;
}

static kempe_status step(void *solver)
{
    arkode *s = solver;
    kmp_sun_ode *base = &s->base;
    double t = base->t, shorter;
    if (!(t < base->t_end))
        return KEMPE_OK;
    memcpy(base->y_old, kmp_sun_data(base->y), (size_t)base->ode.n * sizeof *base->y_old);
    int bad = s->moved ? reset(s, t, base->y_old, 0) : 0;
    double h = planned(s);
    for (int tries = 0; bad == 0 && tries < MAX_TRIES; tries++) {
        bad = attempt(s, &t, &shorter);
        if (bad == 0) {
            take(s, t);
            return kmp_sun_progress(base, "ARKODE") ? KEMPE_OK : KEMPE_E_FAILED;
        }
        if (bad < 0)
            break;
        h = fmin(h, t > base->t ? t - base->t : h) * shorter;
        base->work.refused++;
        base->work.steps -= t > base->t;
        bad = h > kmp_solver_least_step(base->t) ? reset(s, base->t, base->y_old, h) : ARK_RHSFUNC_FAIL;
        t = base->t;
    }
    return complain(s, bad ? bad : ARK_RHSFUNC_FAIL);
}

static int into_out(void *solver, double t)
{
    arkode *s = solver;
    return KMP_SUN_ARK(GetDky)(s->memory, t, 0, s->base.out);
}

static kempe_status dense(void *solver, double t, double *y, double *yp)
{
    (void)yp;
    return kmp_sun_dense(solver, "ARKODE", t, y, into_out);
}

KMP_SUN_SOLVER(erk, true, false);
KMP_SUN_SOLVER(dirk, false, true);
