/* SPDX-License-Identifier: BSD-3-Clause */
/* Andrews' squeezing mechanism written by hand for the reduced formulation, to judge Kempe's code by: the same
 * algorithm for this one mechanism, its numbers in the code, compiled by itself with -O2 -march=native
 * -ffp-contract=off.
 *
 * y = (beta, theta, gamma, delta, Phi, epsilon, Omega, beta'): u, v and ud of Kempe's choice, coordinates in its order.
 */
#ifndef KEMPE_BENCH_ANDREWS_BY_HAND_H
#define KEMPE_BENCH_ANDREWS_BY_HAND_H

enum { BY_HAND_SIZE = 8 };

typedef struct by_hand_run {
    double y[BY_HAND_SIZE]; /* at the end */
    long steps, rhs;
} by_hand_run;

/** dy = f(y): one sine and cosine of an angle, addition theorems, three blocks of two rows in closed form, M applied to
 * the one column of X. */
void andrews_by_hand_rhs(const double *y, double *dy);

/** The start of the model. */
void andrews_by_hand_start(double *y);

/** From the start to t_end by DOP853, one simplified Newton correction of v at each accepted step; error weights
 * tolerance (1 + |y|), of the rate tolerance (rate_scale + |y|). Nonzero: a step became too small. */
int andrews_by_hand_integrate(double t_end, double tolerance, double rate_scale, by_hand_run *run);

#endif
