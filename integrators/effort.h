/* SPDX-License-Identifier: BSD-3-Clause */
/* The user's force on a dae road, whose residual and iteration matrix are programs that do not know it: its efforts at
 * a state and, by differences, their tangents. All of it does nothing when the system has no such force. */
#ifndef KMP_INTEGRATORS_EFFORT_H
#define KMP_INTEGRATORS_EFFORT_H

#include "constraints/plant.h"

typedef struct kmp_effort {
    kmp_plant *plant; /* not owned; NULL when there is no force */
    int n;
    double *base;    /* n */
    double *state;   /* 2 n: q, qd */
    double *tangent; /* n x 2n, column-major: by q, then by qd */
} kmp_effort;

/** false: no memory; kmp_effort_free may follow. */
bool kmp_effort_init(kmp_effort *effort, kmp_plant *plant);
void kmp_effort_free(kmp_effort *effort);

/** r (n) -= efforts at (t, q, qd). */
void kmp_effort_subtract(kmp_effort *effort, double t, const double *q, const double *qd, double *r);

/** Fills `tangent` at (t, q, qd) by forward differences: 2 n + 1 calls. */
void kmp_effort_differentiate(kmp_effort *effort, double t, const double *q, const double *qd);

#endif
