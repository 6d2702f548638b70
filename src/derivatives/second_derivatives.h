/* SPDX-License-Identifier: BSD-3-Clause */
/* Second derivatives of the equations along two directions that are given in numbers: what a motion near a state
 * becomes where the state and the parameters change. One program, derived once,
 *
 *     d/db d/da (R, h, rate, curve),    R = M qdd + C - J' lambda, rate = J qd + h_t, curve = J qdd + jdqd,
 *
 * a a direction of (q, qd, qdd, lambda), b one of these and of the parameters that vary. */
#ifndef KMP_DERIVATIVES_SECOND_DERIVATIVES_H
#define KMP_DERIVATIVES_SECOND_DERIVATIVES_H

#include "integrators/run/instant.h"

typedef struct kmp_bend {
    kmp_formulas bent;
    int n, m, count; /* coordinates, rows, parameters */
    double *along;   /* of the program: a (3 n + m), b (3 n + m + count) */
} kmp_bend;

/** A course: changes of q, qd, qdd (n each) and lambda (m). NULL: none. */
typedef struct kmp_course {
    const double *q, *qd, *qdd, *lambda;
} kmp_course;

/** What comes out: of R (n), h, rate and curve (m each), until the next call. */
typedef struct kmp_bent {
    const double *force, *h, *rate, *curve;
} kmp_bent;

/** `names`: of parameters of the system's model that vary; those that follow from them go with them.
 *  KEMPE_E_ARGUMENT: a name that does not stay open. KEMPE_E_FAILED: the user's force has no second derivatives that
 * anyone knows. KEMPE_E_MEMORY. */
kempe_status kmp_bend_init(kmp_bend *bend, const kempe_system *system, const kmp_backend *backend, int count,
                           const char *const *names);
void kmp_bend_free(kmp_bend *bend);

/** At the last state that `bent` was placed at, along a and b; `parameter` is how each parameter changes along b (NULL:
 * not). No allocation. */
kmp_bent kmp_bend_along(kmp_bend *bend, const kmp_course *a, const kmp_course *b, const double *parameter);

#endif
