/* SPDX-License-Identifier: BSD-3-Clause */
/* Efforts of chosen coordinates (actuators) for a given motion, with the loops closed:
 *
 *     M qdd + C = J' lambda + S tau,      N' (M qdd + C) = N' S tau,
 *
 * J the rows of loops alone, without drives and locks, whose efforts come from the actuators or from nowhere; N = X of
 * the partition of these rows (Fisette and Samin 1996, eq. 44); p equations for a efforts. In coordinates scaled by the
 * characteristic length, where all efforts are in N m, and with N made orthonormal the equations are A tau = f, and the
 * singular values of A are the cosines between actuators and freedoms, whatever the units and the choice of u: 1 is the
 * most that there can be, 0 says that some freedom is out of reach. Of all tau that meet the equations best (least
 * squares), that of least sum of weight tau^2. The multipliers are those of the independent rows; where forces depend
 * on them, C is at those that go with tau. */
#ifndef KMP_STUDIES_INVERSE_INVERSE_DYNAMICS_H
#define KMP_STUDIES_INVERSE_INVERSE_DYNAMICS_H

#include "base/arena.h"
#include "constraints/partition/reduction.h"
#include "linalg/dense/singular.h"

typedef struct kmp_inverse {
    const kempe_system *system;
    kmp_plant *plant; /* not owned */
    int n, m, p, a;
    int *actuator;            /* a */
    double *weight;           /* a, positive */
    bool *left_out;           /* m: rows of drives and locks */
    double *masked;           /* J without them */
    kmp_arena arena, choices; /* of all arrays; of those that a choice of coordinates needs */
    kmp_partition part;
    kmp_reduction red;
    kmp_singular svd;
    double *gram, *matrix, *reach; /* p x p, p x a, p: L of N'N = LL', A, f */
    double *inner, *choice;        /* p x p, p */
    double *rest, *sum, *inertia;  /* n; M qdd where forces depend on multipliers */

    double *tau;    /* a: N m or N; these of the last state */
    double *lambda; /* m; zero for rows of drives and those that are dropped */
    double *left;   /* p: N' (M qdd + C - S tau), by u: what the actuators cannot bring about */
    double unmet;   /* |left| in the metric above, N m; and how large its parts are */
    double size;
    int rank;        /* of A */
    double hold;     /* its p-th singular value, the smallest that counts; 0 when a < p */
    double residual; /* max |M qdd + C - J' lambda - S tau| over the largest sum of the four terms, scaled */
} kmp_inverse;

/** `weight` NULL: all 1. The plant is used, and kept by the caller. KEMPE_E_MEMORY. */
kempe_status kmp_inverse_init(kmp_inverse *inverse, kmp_plant *plant, int count, const int *actuator,
                              const double *weight);
void kmp_inverse_free(kmp_inverse *inverse);

/** At a closed state. Independent coordinates are chosen anew where they go bad, otherwise nothing is allocated.
 *  KEMPE_E_FAILED: the loops are singular there, or something is not finite. */
kempe_status kmp_inverse_at(kmp_inverse *inverse, double t, const double *q, const double *qd, const double *qdd);

#endif
