/* SPDX-License-Identifier: BSD-3-Clause */
/* Second derivatives of the equations along two numeric directions, for the change of a motion near a state when state
 * and parameters change. One program, derived once,
 *
 *     d/db d/da (R, h, rate, curve),    R = M qdd + C - J' lambda, rate = J qd + h_t, curve = J qdd + jdqd,
 *
 * with a a direction of (q, qd, qdd, lambda), and b a direction of these and of the variable parameters. */
#ifndef KMP_DERIVATIVES_SECOND_DERIVATIVES_H
#define KMP_DERIVATIVES_SECOND_DERIVATIVES_H

#include "integrators/run/instant.h"

typedef struct kmp_bend {
    kmp_formulas bent;
    int n, m, count; /* coordinates, rows, parameters */
    double *along;   /* of the program: a (3 n + m), b (3 n + m + count) */
} kmp_bend;

/** A direction: changes of q, qd, qdd (n each) and lambda (m). NULL: none. */
typedef struct kmp_course {
    const double *q, *qd, *qdd, *lambda;
} kmp_course;

/** Second derivatives of R (n), h, rate and curve (m each), valid until the next call. */
typedef struct kmp_bent {
    const double *force, *h, *rate, *curve;
} kmp_bent;

/** `names`: of variable parameters of the system's model; dependent parameters change with them. KEMPE_E_ARGUMENT: a
 * name that is not variable. KEMPE_E_FAILED: the user's force has no second derivatives. KEMPE_E_MEMORY. */
kempe_status kmp_bend_init(kmp_bend *bend, const kempe_system *system, const kmp_backend *backend, int count,
                           const char *const *names);
void kmp_bend_free(kmp_bend *bend);

/** Evaluates them at the state of `bent`, along a and b; `parameter` is the change of each parameter along b (NULL:
 * none). No allocation. */
kmp_bent kmp_bend_along(kmp_bend *bend, const kmp_course *a, const kmp_course *b, const double *parameter);

#endif
