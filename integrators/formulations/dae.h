/* SPDX-License-Identifier: BSD-3-Clause */
/* Interface between a DAE formulation and an implicit integrator: F(t, y, y') = 0 with an analytic sparse iteration
 * matrix. */
#ifndef KMP_INTEGRATORS_FORMULATIONS_DAE_H
#define KMP_INTEGRATORS_FORMULATIONS_DAE_H

#include "integrators/steppers/ode.h"

typedef struct kmp_dae {
    int n, nz;                  /* unknowns; entries of dF/dy + cj dF/dy' */
    const long *col_start;      /* n + 1, compressed columns, rows ascending in each */
    const long *row;            /* nz */
    const double *differential; /* n: 1 for a differential unknown, 0 for an algebraic one */
    const double *factor;       /* n: multiplies the error weight (1e8 excludes an unknown from every test) */
    void *self;

    /** r = F(t, y, yp). KMP_GO, KMP_RETRY or KMP_HALT. */
    int (*residual)(void *self, double t, const double *y, const double *yp, double *r);

    /** values[nz] = dF/dy + cj dF/dy'. */
    int (*matrix)(void *self, double t, double cj, const double *y, const double *yp, double *values);

    /** Called after every step that the integrator accepts. KMP_RETRY: the integrator restarts with a shorter step.
     * KMP_HALT ends the run. NULL: none. */
    int (*accept)(void *self, double t, const double *y, const double *yp);
} kmp_dae;

#endif
