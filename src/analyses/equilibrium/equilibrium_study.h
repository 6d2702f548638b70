/* SPDX-License-Identifier: BSD-3-Clause */
/* Static or steady equilibrium: R(u) = N'(M qdd + C) = 0 at given constant rates ud and udd = 0 (static: all rates
 * zero), with the closures satisfied. R is measured as work: R_k times the size of u_k. It is relative to the sum of
 * the works of all forces along u_k and of their changes by one such size of any coordinate. */
#pragma once

#include "analyses/derivatives/linearized.h"
#include "analyses/equilibrium/steady.h"
#include "model/data/force.h"

enum { KMP_MOST_ITERATIONS = 400 };

typedef struct kmp_search {
    kmp_steady *rates; /* of coordinates that stay independent; released ones receive the result */
    int rate_count;    /* 0: `rates` has room for all coordinates */
    bool newton;   /* Newton's method from the guess, to any equilibrium nearby; otherwise a descent, to a stable one */
    bool balanced; /* descent in short steps, to any balanced state */
    bool quiet;    /* failures give no further message */
    bool warned;   /* warnings of a steady motion were given before */
    bool keeps;    /* rigid contacts stay open or closed as they are in the evaluator */
    bool of_part;  /* a part of a mechanism: it leaves also a balanced start that is not stable, as the whole does */
    struct kmp_exchange *exchange; /* other unknowns and equations (exchange.h); NULL: none */
    int iterations;
    double residuals[KMP_MOST_ITERATIONS], steps[KMP_MOST_ITERATIONS]; /* a step's length: the largest |dq| / scale */
    double residual;                                                   /* reached */
    int exchanges; /* of independent coordinates during the search */
} kmp_search;

/** Searches from q (n, closed, in the charts of linear->eval), which becomes the equilibrium; charts may be centred.
 * Rigid contacts that press there are closed in the evaluator.
 * `linear` then has this state, with its matrices, and possibly other independent coordinates. KEMPE_E_FAILED, with the
 * reason: there is none, or it is not found; q and rates are then restored. */
kempe_status kmp_equilibrium_find(kmp_linear *linear, double t, double *q, kmp_search *search);

/** Coordinates that nothing depends on, at the state and near it, in `idle` (p); returns their number, -1: no memory.
 */
int kmp_equilibrium_idle(kmp_linear *linear, int *idle);

/** The residual of the last state, its matrices made. */
double kmp_equilibrium_residual(const kmp_linear *linear);

#define KMP_WAY_FLAT 1e-11 /* an eigenvalue of the scaled Kr below is zero */

/** u_k in its characteristic size. */
double kmp_descent_scale(const kmp_linear *l, int k);

/** The residual of a state whose matrices are made, all of R; `work` (p) receives the reference of each R_k. */
double kmp_descent_measure(const kmp_linear *l, double *work, double *most);

/** True if R does not change with u_k, to first order, and u_k is not the motion of a state; `work` as from
 * kmp_descent_measure. */
bool kmp_descent_is_idle(const kmp_linear *l, int k, const double *work);
