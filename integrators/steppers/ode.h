/* SPDX-License-Identifier: BSD-3-Clause */
/* Interface between a formulation and an integrator: an initial value problem with a callback at every accepted step.
 * Integrators are independent of mechanisms, formulations of integration methods. */
#ifndef KMP_INTEGRATORS_STEPPERS_ODE_H
#define KMP_INTEGRATORS_STEPPERS_ODE_H

#include <stdbool.h>

/* Results of a callback. */
enum {
    KMP_GO = 0,
    KMP_RETRY = 1,  /* this state cannot be evaluated, or this step is rejected: try a smaller one */
    KMP_HALT = -1,  /* give up; the formulation keeps the reason */
    KMP_CHANGED = 2 /* the unknowns have changed their meaning: restart from them */
};

typedef struct kmp_ode {
    int n;
    void *self;

    /** dy = f(t, y). */
    int (*rhs)(void *self, double t, const double *y, double *dy);

    /** Called with a step that passed the error test: the new t, y and dy = f(t, y) (rhs was evaluated there last), and
     * the error weights `w` (an error of w[i] in y[i] is at the tolerance). May correct y slightly in place; KMP_RETRY
     * rejects the step. NULL: none. */
    int (*accept)(void *self, double t, double *y, const double *dy, const double *w);

    /** j = df/dy (n x n, column-major, zeroed before), exact. NULL: there is none. For implicit integrators. */
    int (*jacobian)(void *self, double t, const double *y, double *j);

    /** For an integrator that chooses where to evaluate (singular_step.h). Closes y, unless `as_it_is`; then computes
     * dy = f(t, y) with nothing left out, and the distance from a singularity of f over its usual value. dy or distance
     * may be NULL. NULL: none. */
    int (*closed)(void *self, double t, double *y, bool as_it_is, double *dy, double *distance);
    int positions;   /* y[positions + i] is the derivative of y[i] for i < positions */
    int quadratures; /* the last of y, on which f does not depend */
} kmp_ode;

/** Error control: weight of y[i] is atol[i] + rtol max(|y_old|, |y_new|). */
typedef struct kmp_tolerance {
    double rtol;
    const double *atol;
} kmp_tolerance;

#endif
