/* SPDX-License-Identifier: BSD-3-Clause */
/* What the adapters of CVODE and ARKODE share: an ODE behind SUNDIALS's vectors, matrix and callbacks. */
#ifndef KMP_INTEGRATORS_SUNDIALS_ODE_H
#define KMP_INTEGRATORS_SUNDIALS_ODE_H

#include "constraints/sundials_compat.h"
#include "integrators/solver.h"

#include <stdbool.h>
#include <sundials/sundials_linearsolver.h>
#include <sundials/sundials_matrix.h>

/* A solver begins with one: it is the user data of the callbacks. */
typedef struct kmp_sun_ode {
    kempe_context *context;
    kmp_ode ode;
    kmp_tolerance tolerance;
    SUNContext sun;
    N_Vector y, atol, out;
    SUNMatrix matrix; /* dense, for implicit methods; else NULL */
    SUNLinearSolver linear;
    double *y_old, *dy, *w;
    double t, t_old, t_end;
    bool halted; /* the road gave up in a callback */
    int hopeless;
    kmp_solver_work work; /* what SUNDIALS does not count: evaluations, steps refused by the road (less as steps) */
} kmp_sun_ode;

bool kmp_sun_ode_init(kmp_sun_ode *s, const kmp_solver_setup *setup, bool implicit);
void kmp_sun_ode_free(kmp_sun_ode *s);
void kmp_sun_ode_begin(kmp_sun_ode *s, double t, const double *y, double t_end);

/* Callbacks; user is the solver. KMP_RETRY becomes a recoverable failure, KMP_HALT a fatal one. */
int kmp_sun_rhs(sunrealtype t, N_Vector y, N_Vector dy, void *user);
int kmp_sun_jacobian(sunrealtype t, N_Vector y, N_Vector dy, SUNMatrix j, void *user, N_Vector w1, N_Vector w2,
                     N_Vector w3);

/** The road's say about the step that ended at (t, y), y having been evaluated last: KMP_GO, KMP_RETRY, KMP_HALT. */
int kmp_sun_accept(kmp_sun_ode *s, double t, double *y);

/** Field by field. */
kmp_solver_work kmp_sun_sum(kmp_solver_work a, kmp_solver_work b);

/** "NAME stopped at t = ..: meaning (flag)" unless the road halted, which has its own reason. */
kempe_status kmp_sun_complain(kmp_sun_ode *s, const char *name, const char *meaning, const char *flag);

/** After a step: false, with a message, when steps have collapsed. */
bool kmp_sun_progress(kmp_sun_ode *s, const char *name);

/* Behind the socket. */
double kmp_sun_t(const void *solver);
double kmp_sun_t_old(const void *solver);

/** y at t within the last step; `into_out` has SUNDIALS put it into s->out, not 0 when it cannot. */
kempe_status kmp_sun_dense(kmp_sun_ode *s, const char *name, double t, double *y, int (*into_out)(void *s, double t));

/* The kind of an integrator whose file has create_ID and the static functions of its kind. */
#define KMP_SUN_SOLVER(id, is_corrected, is_implicit)                                                                  \
    const kmp_solver_kind kmp_solver_##id = {.name = #id,                                                              \
                                             .corrects = is_corrected,                                                 \
                                             .implicit = is_implicit,                                                  \
                                             .create = create_##id,                                                    \
                                             .release = release,                                                       \
                                             .start = start,                                                           \
                                             .step = step,                                                             \
                                             .t = kmp_sun_t,                                                           \
                                             .t_old = kmp_sun_t_old,                                                   \
                                             .dense = dense,                                                           \
                                             .work = work}

#endif
