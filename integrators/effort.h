/* SPDX-License-Identifier: BSD-3-Clause */
/* The user's force on a dae road, whose residual and iteration matrix are programs that do not know it: its efforts at
 * a state and, by differences, their tangents. All of it does nothing when the system has no such force. */
#ifndef KMP_INTEGRATORS_EFFORT_H
#define KMP_INTEGRATORS_EFFORT_H

#include "dynamics/system.h"

typedef struct kmp_effort {
    const kempe_system *system; /* NULL when there is no force */
    int n;
    double *value;   /* n: of the last evaluation, not finite where it cannot be had */
    double *moved;   /* n */
    double *state;   /* 2 n: q, qd */
    double *tangent; /* n x 2n, column-major: by q, then by qd */
} kmp_effort;

/** false: no memory; kmp_effort_free may follow. */
bool kmp_effort_init(kmp_effort *effort, const kempe_system *system);
void kmp_effort_free(kmp_effort *effort);

/** Fills `value` at (t, q, qd). */
void kmp_effort_eval(kmp_effort *effort, double t, const double *q, const double *qd);

/** Fills `value` and `tangent` by forward differences: 2 n + 1 calls. */
void kmp_effort_differentiate(kmp_effort *effort, double t, const double *q, const double *qd);

#endif
