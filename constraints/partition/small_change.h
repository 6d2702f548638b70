/* SPDX-License-Identifier: BSD-3-Clause */
/* First-order response of a closed mechanism to a small change, by the implicit-function theorem. With dq = X du - (0;
 * Jv^-1 h), and dqd and dqdd from
 *
 *     J dqd + (J qd + h_t)_q dq = -rate      J dqdd + (J qdd + jdqd)_q dq + (J qdd + jdqd)_qd dqd = -curve
 *
 * and M dqdd + R_q dq + R_qd dqd + force = J' dlambda, with R the residual including lambda. X' eliminates dlambda (X'
 * J' = 0) and leaves dR. Wehage and Haug 1982 for the partitioning; differentiation as in Fisette and Samin 1996, sec.
 * 4. */
#pragma once

#include "constraints/evaluation/tangent.h"
#include "constraints/partition/reduction.h"

/** A small change of the independent coordinates (p each), and of the equations, as by a parameter: of h, J qd + h_t
 * and J qdd + jdqd (m each) and of M qdd + C - J' lambda (n). NULL: none. */
typedef struct kmp_change {
    const double *u, *ud, *udd;
    const double *h, *rate, *curve, *force;
} kmp_change;

/** The response to a change; each member is NULL when not wanted. */
typedef struct kmp_response {
    double *q, *qd, *qdd; /* n */
    double *lambda;       /* m: zero for dropped rows */
    double *residual;     /* p: dR */
} kmp_response;

/** dq for changes du of u (p; NULL: none) and `rows` of h (m): X du - (0; Jv^-1 rows), only from factors and
 * tangent. Room: 2 n. */
void kmp_spread(const kmp_reduction *red, const double *du, const double *rows, double *room, double *out);

/** Computes the response at the state of the derivatives `d`, where the reduction has factors and tangent. Forces that
 * depend on multipliers change with the multipliers of the given accelerations; or, with `moving`, of the resulting
 * ones (kmp_reduction_load_change, with its factors). Room: KMP_FOLLOW_ROOM. No allocation. Without such forces and
 * without lambda in the response other threads may follow other changes at the same time, with other room. */
#define KMP_FOLLOW_ROOM(n, m) (7 * (n) + (m))
void kmp_follow(kmp_reduction *red, const kmp_tangents *tangents, const double *d, bool moving,
                const kmp_change *change, const kmp_response *response, double *room);
