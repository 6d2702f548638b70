/* SPDX-License-Identifier: BSD-3-Clause */
/* The socket behind which all integrators look alike: made for an ODE or a DAE, started at a state, stepped, asked
 * between steps. A new integrator is one file with a kmp_solver_kind and a row in integrators.def. */
#ifndef KMP_INTEGRATORS_STEPPERS_SOLVER_H
#define KMP_INTEGRATORS_STEPPERS_SOLVER_H

#include "base/context.h"
#include "integrators/formulations/dae.h"
#include "integrators/steppers/ode.h"

typedef struct kmp_solver_setup {
    kempe_context *context;
    const kmp_ode *ode; /* one of the two, by `dae` of the kind */
    const kmp_dae *dae;
    kmp_tolerance tolerance;
    const char *linear; /* row of linear.def, for implicit integrators */
} kmp_solver_setup;

/** What was done since it was made, over all starts. */
typedef struct kmp_solver_work {
    long steps, rejected,
        refused; /* rejected by the error test; refused by the formulation or for want of convergence */
    long rhs;    /* right-hand sides or residuals */
    long newton, matrices, factorizations;
} kmp_solver_work;

/** Every integrator begins with one, which its owner reads. */
typedef struct kmp_solver {
    double t, t_old; /* ends of the last accepted step; equal when there was none since the start */
    double t_end;
    double h;     /* the step it would try next, for a start from the same place in other unknowns; 0: the last one */
    int hopeless; /* steps in a row that are hardly resolved */
    kmp_solver_work work;
} kmp_solver;

typedef struct kmp_solver_kind {
    const char *name;
    bool dae;           /* solves F(t, y, y') = 0 instead of y' = f(t, y) */
    bool corrects;      /* lets `accept` correct y and refuse a step: one-step methods */
    bool implicit;      /* uses the Jacobian of the ODE when there is one */
    bool standard;      /* compare runs it unasked */
    const void *method; /* for `create`, where several kinds have the same functions */

    /** A struct that begins with a kmp_solver; NULL after a message. What `setup` points to outlives the solver. */
    void *(*create)(const struct kmp_solver_kind *kind, const kmp_solver_setup *setup);
    void (*release)(void *solver);

    /** Begins, or begins anew, at (t, y[, yp]) towards t_end; h0 is the first step, 0 lets an explicit method choose.
     */
    kempe_status (*start)(void *solver, double t, const double *y, const double *yp, double t_end, double h0);

    /** One accepted step, the last one ending exactly at t_end. KEMPE_E_FAILED: no step could be made; the context may
     * hold a sentence, else the step became too small or the formulation gave up. */
    kempe_status (*step)(void *solver);

    /** y (and y' when yp is not NULL, of a DAE) at t_old <= t <= t. */
    kempe_status (*dense)(void *solver, double t, double *y, double *yp);
} kmp_solver_kind;

/** Row k of the table, NULL after the last; by name, NULL when there is none. */
const kmp_solver_kind *kmp_solver_get(int k);
const kmp_solver_kind *kmp_solver_find(const char *name);

/** What double precision resolves at t decides how short a step may be, never the end of the run: a shorter one than
 * this is not tried. */
double kmp_solver_least_step(double t);

/** The step to try where `next` is wished, 0 when it has become too short, and where it ends: at t_end exactly when it
 * would come near, half way when little more than one step is left. */
double kmp_solver_next_step(double t, double t_end, double next, double *t_new);

/** After a step of length h that ended at t: true when more than 100 in a row (counted in *hopeless, 0 at a start) were
 * hardly longer than the least. An integrator gives up then, and says KMP_SOLVER_COLLAPSED. Long runs of other steps
 * end by the bound on work (work_bound.h). */
bool kmp_solver_collapsed(int *hopeless, double h, double t);

#define KMP_SOLVER_COLLAPSED                                                                                           \
    "steps have become so short that double precision hardly resolves them at this time: the motion is singular "      \
    "there, or too fast"

/** Whether a linear solver of that name exists ("auto" does), and all names, comma-separated. */
bool kmp_linear_known(const char *name);
const char *kmp_linear_names(void);

#define KMP_SOLVER(name) extern const kmp_solver_kind kmp_solver_##name;
#include "integrators/steppers/integrators.def"
#undef KMP_SOLVER

#endif
