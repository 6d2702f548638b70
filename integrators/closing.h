/* SPDX-License-Identifier: BSD-3-Clause */
/* States of all coordinates brought back to the closures to rounding, as rows and new starts want them. */
#ifndef KMP_INTEGRATORS_CLOSING_H
#define KMP_INTEGRATORS_CLOSING_H

#include "integrators/road.h"

typedef struct kmp_closing {
    void *self;
    kmp_plant *plant;
    int n;
    double *violation, *dx; /* room: m, n */
    /** Closure, mass and factors at (t, q): KMP_GO, or what place is to say when they are singular. */
    int (*place)(void *self, double t, const double *q);
    /** dx with J dx = -violation (m), mass-orthogonal, with these factors. */
    void (*correction)(void *self, const double *violation, double *dx);
} kmp_closing;

/** By a saddle system, which outlives it. */
kmp_closing kmp_closing_by_saddle(kmp_saddle *saddle, double *violation, double *dx);

/** Two corrections of q and qd; the plant's closure and mass and the factors are then at the result. KMP_GO, or what
 * `place` said: q and qd are then worth nothing. */
int kmp_closing_run(const kmp_closing *closing, double t, double *q, double *qd);

#endif
