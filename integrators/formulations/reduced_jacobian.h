/* SPDX-License-Identifier: BSD-3-Clause */
/* What a small change of a closed mechanism leads to, by the implicit-function theorem; and by that, the exact Jacobian
 * of the reduced right-hand side. With dq = X du - (0; Jv^-1 h), the other rows likewise:
 *
 *     J dqd + (J qd + h_t)_q dq = -rate      J dqdd + (J qdd + jdqd)_q dq + (J qdd + jdqd)_qd dqd = -curve
 *
 * and M dqdd + R_q dq + R_qd dqd + force = J' dlambda, R being the residual with lambda inside. X' takes dlambda out
 * (X' J' = 0) and leaves dR. Wehage and Haug 1982 for the partitioning; differentiation as in Fisette and Samin 1996,
 * sec. 4. */
#ifndef KMP_INTEGRATORS_FORMULATIONS_REDUCED_JACOBIAN_H
#define KMP_INTEGRATORS_FORMULATIONS_REDUCED_JACOBIAN_H

#include "base/arena.h"
#include "constraints/partition/reduction.h"
#include "integrators/formulations/tangent.h"

/** A small change: of the independent coordinates (p each), and of the equations themselves, as a parameter makes it:
 * of h, J qd + h_t and J qdd + jdqd (m each) and of M qdd + C - J' lambda (n). NULL: none. */
typedef struct kmp_change {
    const double *u, *ud, *udd;
    const double *h, *rate, *curve, *force;
} kmp_change;

/** What follows of it, each NULL when it is not wanted. */
typedef struct kmp_response {
    double *q, *qd, *qdd; /* n */
    double *lambda;       /* m: zero for rows that are dropped */
    double *residual;     /* p: dR */
} kmp_response;

/** dq where u changes by du (p; NULL: not) and h by `rows` (m): X du - (0; Jv^-1 rows), of factors and tangent alone.
 */
void kmp_spread(kmp_reduction *red, const double *du, const double *rows, double *out);

/** At the state of the derivatives `d`, where the reduction has factors and tangent. Forces that depend on multipliers
 * change with those that belong to the accelerations given; or, `moving`, to those that follow
 * (kmp_reduction_press_change, whose factors are there). Room: 5 n + m. No allocation. */
void kmp_follow(kmp_reduction *red, const kmp_tangents *tangents, const double *d, bool moving,
                const kmp_change *change, const kmp_response *response, double *room);

typedef struct kmp_reduced_jacobian {
    kmp_arena arena; /* of all arrays */
    kmp_tangents tangents;
    kmp_reduction *red;          /* not owned */
    double *qdd, *lambda, *unit; /* n, m, 2 p */
    double *dq, *dqd, *room;     /* n, n, 5 n + m */
} kmp_reduced_jacobian;

/** `power`: the state has the work of non-conservative forces as its last entry. */
kempe_status kmp_reduced_jacobian_init(kmp_reduced_jacobian *jacobian, kmp_reduction *red, bool power);
void kmp_reduced_jacobian_free(kmp_reduced_jacobian *jacobian);

/** j = d(ud, udd[, power]) / d(u, ud[, work]), column-major of leading dimension `size`, zeroed before, at a state
 * where the reduction has factors, tangent and the accelerations udd. The power of moving closures, and what
 * multipliers change of the power of forces, is left out of the last row. No allocation. */
void kmp_reduced_jacobian_eval(kmp_reduced_jacobian *jacobian, double t, const double *q, const double *qd,
                               const double *udd, int size, double *j);

/** j = dF/d(u, ud[, work]) + cj dF/d(u', ud'[, work']), likewise, of F = (u' - ud, X' (M qdd + C)[, work' - power]) at
 * ud' = udd, where the reduction has factors, tangent and a0, the plant M and C. */
void kmp_reduced_jacobian_of_residual(kmp_reduced_jacobian *jacobian, double t, double cj, const double *q,
                                      const double *qd, const double *udd, int size, double *j);

#endif
