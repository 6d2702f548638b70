/* SPDX-License-Identifier: BSD-3-Clause */
/* Second derivatives of the equations along two numeric directions, for the change of a motion near a state when state
 * and parameters change. One program, derived once,
 *
 *     d/db d/da (R, h, rate, curve),    R = M qdd + C - J' lambda, rate = J qd + h_t, curve = J qdd + jdqd,
 *
 * with a a direction of (q, qd, qdd, lambda), and b a direction of these and of the variable parameters. */
#pragma once

#include "integrators/formulations/evaluation_point.h"

typedef struct kmp_second_derivatives {
    kmp_formulas bent;
    int n, m, count; /* coordinates, rows, parameters */
    double *along;   /* of the program: a (3 n + m), b (3 n + m + count) */
} kmp_second_derivatives;

/** A direction: changes of q, qd, qdd (n each) and lambda (m). NULL: none. */
typedef struct kmp_variation {
    const double *q, *qd, *qdd, *lambda;
} kmp_variation;

/** Second derivatives of R (n), h, rate and curve (m each), valid until the next call. */
typedef struct kmp_second_values {
    const double *force, *h, *rate, *curve;
} kmp_second_values;

/** `names`: of variable parameters of the system's model; dependent parameters change with them. KEMPE_E_ARGUMENT: a
 * name that is not variable. KEMPE_E_FAILED: the user's force has no second derivatives. KEMPE_E_MEMORY. */
kempe_status kmp_second_derivatives_init(kmp_second_derivatives *second, const kempe_system *system,
                                         const kmp_backend *backend, int count, const char *const *names);
void kmp_second_derivatives_free(kmp_second_derivatives *second);

/** Evaluates them at the state of `bent`, along a and b; `parameter` is the change of each parameter along b (NULL:
 * none). No allocation. */
kmp_second_values kmp_second_derivatives_along(kmp_second_derivatives *second, const kmp_variation *a,
                                               const kmp_variation *b, const double *parameter);
