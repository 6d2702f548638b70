/* SPDX-License-Identifier: BSD-3-Clause */
/* First-order response of a closed mechanism to a small change, by the implicit-function theorem, and from it the exact
 * Jacobian of the reduced right-hand side. With dq = X du - (0; Jv^-1 h), and dqd and dqdd from
 *
 *     J dqd + (J qd + h_t)_q dq = -rate      J dqdd + (J qdd + jdqd)_q dq + (J qdd + jdqd)_qd dqd = -curve
 *
 * and M dqdd + R_q dq + R_qd dqd + force = J' dlambda, with R the residual including lambda. X' eliminates dlambda (X'
 * J' = 0) and leaves dR. Wehage and Haug 1982 for the partitioning; differentiation as in Fisette and Samin 1996, sec.
 * 4. */
#pragma once

#include "base/arena.h"
#include "constraints/partition/reduction.h"
#include "integrators/formulations/tangent.h"
#include "model/data/force.h"

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

/** dq for changes du of u (p; NULL: none) and `rows` of h (m): X du - (0; Jv^-1 rows), from factors and tangent
 * alone. Room: 2 n. */
void kmp_spread(const kmp_reduction *red, const double *du, const double *rows, double *room, double *out);

/** Computes the response at the state of the derivatives `d`, where the reduction has factors and tangent. Forces that
 * depend on multipliers change with those of the given accelerations; or, with `moving`, of the resulting ones
 * (kmp_reduction_load_change, with its factors). Room: KMP_FOLLOW_ROOM. No allocation. Without such forces and without
 * lambda in the response other threads may follow other changes at the same time, with other room. */
#define KMP_FOLLOW_ROOM(n, m) (7 * (n) + (m))
void kmp_follow(kmp_reduction *red, const kmp_tangents *tangents, const double *d, bool moving,
                const kmp_change *change, const kmp_response *response, double *room);

typedef struct kmp_reduced_jacobian {
    kmp_arena arena; /* of all arrays */
    kmp_tangents tangents;
    kmp_reduction *red;   /* not owned */
    double *qdd, *lambda; /* n, m */
    int pieces, columns;  /* pieces of work, of so many columns each */
    double *room;         /* of all pieces, one after another */
    size_t room_of_piece;
} kmp_reduced_jacobian;

kempe_status kmp_reduced_jacobian_init(kmp_reduced_jacobian *jacobian, kmp_reduction *red);
void kmp_reduced_jacobian_free(kmp_reduced_jacobian *jacobian);

/** j = d(ud, udd[, power]) / d(u, ud[, work]), column-major of leading dimension `size`, zeroed before, at a state
 * where the reduction has factors, tangent and the accelerations udd. The last row excludes the power of moving
 * closures, and the effect of multipliers on the power of forces. No allocation. */
void kmp_reduced_jacobian_eval(kmp_reduced_jacobian *jacobian, double t, const double *q, const double *qd,
                               const double *udd, int size, double *j);

/** j = dF/d(u, ud[, work]) + cj dF/d(u', ud'[, work']), column-major as in kmp_reduced_jacobian_eval, of F = (u' - ud,
 * X' (M qdd + C)[, work' - power]) at ud' = udd, where the reduction has factors, tangent and a0, the evaluator M and
 * C. */
void kmp_reduced_jacobian_of_residual(kmp_reduced_jacobian *jacobian, double t, double cj, const double *q,
                                      const double *qd, const double *udd, int size, double *j);
