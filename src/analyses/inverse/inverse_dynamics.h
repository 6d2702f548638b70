/* SPDX-License-Identifier: BSD-3-Clause */
/* Generalized forces of chosen coordinates (actuators) for a given motion, with the loops closed:
 *
 *     M qdd + C = J' lambda + S tau,      N' (M qdd + C) = N' S tau.
 *
 * J has only the rows of loops. Rows of drives and locks are left out: their forces must be supplied by the actuators.
 * N = X of the partition of these rows (Fisette and Samin 1996, eq. 44); there are p equations for a actuators.
 *
 * Coordinates are scaled by the characteristic length, so that all generalized forces are in N m, and N is made
 * orthonormal. Then the equations are A tau = f, and the singular values of A are the cosines between actuators and
 * degrees of freedom. They are independent of units and of the choice of u. The largest possible one is 1; 0 means that
 * a degree of freedom cannot be actuated. Of all tau that satisfy the equations best (least squares) the result has the
 * least sum of weight tau^2. The multipliers belong to the independent rows; where forces depend on them, C uses the
 * multipliers that belong to tau.
 *
 * States have a separate equation, which no actuator has a part in: it is left out. */
#pragma once

#include "analyses/dense/singular_values.h"
#include "base/arena.h"
#include "constraints/partition/reduction.h"

typedef struct kmp_inverse {
    const kempe_system *system;
    kmp_evaluator *eval; /* not owned */
    int n, m, p, a;
    int *actuator;            /* a */
    double *weight;           /* a, positive */
    bool *left_out;           /* m: rows of drives and locks */
    double *masked;           /* J without them */
    kmp_arena arena, choices; /* of all arrays; of the values that depend on the choice of coordinates */
    kmp_partition part;
    kmp_reduction red;
    kmp_singular svd;
    double *gram, *matrix, *reach; /* p x p, p x a, p: L of N'N = LL', A, f */
    double *inner, *choice;        /* p x p, p */
    double *rest, *sum, *inertia;  /* n; M qdd where forces depend on multipliers */

    double *tau;    /* a: N m or N; these of the last state */
    double *lambda; /* m; zero for rows of drives and dropped rows; of friction that sticks in runs: its force */
    double *change; /* of each condition */
    double *left;   /* p: N' (M qdd + C - S tau), by u: the part that the actuators cannot provide */
    double unmet;   /* |left| in the metric above, N m; and the size of its terms */
    double size;
    int freedoms;    /* p without the motions of states */
    int rank;        /* of A */
    double hold;     /* its p-th singular value, the smallest that counts; 0 when a < p */
    double residual; /* max |M qdd + C - J' lambda - S tau| over the largest sum of the four terms, scaled */
} kmp_inverse;

/** `weight` NULL: all 1. The evaluator is used, and owned by the caller. KEMPE_E_MEMORY. */
kempe_status kmp_inverse_init(kmp_inverse *inverse, kmp_evaluator *eval, int count, const int *actuator,
                              const double *weight);
void kmp_inverse_free(kmp_inverse *inverse);

/** Inverse dynamics at a closed state. Independent coordinates are chosen again where they become ill-conditioned,
 * otherwise there is no allocation. KEMPE_E_FAILED: the loops are singular there, or a value is not finite. */
kempe_status kmp_inverse_at(kmp_inverse *inverse, double t, const double *q, const double *qd, const double *qdd);
