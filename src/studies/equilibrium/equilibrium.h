/* SPDX-License-Identifier: BSD-3-Clause */
/* Where a mechanism stays at rest, or moves on steadily: R(u) = N'(M qdd + C) = 0 at given constant rates ud and udd =
 * 0 (static: all rates zero), the closures met. R is judged as work: R_k times the size of u_k, over the sum of the
 * works of all that acts along u_k and of what one such size of any coordinate changes. */
#ifndef KMP_STUDIES_EQUILIBRIUM_EQUILIBRIUM_H
#define KMP_STUDIES_EQUILIBRIUM_EQUILIBRIUM_H

#include "derivatives/linearized.h"
#include "studies/equilibrium/steady.h"

/** One state on the way: its residual, and how far the step from it went, the largest |dq| / scale. */
typedef struct kmp_iteration {
    double residual, step;
} kmp_iteration;

enum { KMP_MOST_ITERATIONS = 400 };

typedef struct kmp_search {
    kmp_steady *rates; /* of coordinates that stay independent; those that are freed become what is found */
    int rate_count;
    bool newton;   /* Newton's method from the guess, to whatever is near; otherwise the way goes down, to a stable
                      one */
    bool balanced; /* the way goes down in short steps, to whatever is balanced */
    bool quiet;    /* nothing is said of a failure beyond that */
    struct kmp_exchange *exchange; /* other unknowns and equations (analysis/exchange.h); NULL: none */
    int iterations;
    kmp_iteration history[KMP_MOST_ITERATIONS];
    double residual; /* reached */
    int exchanges;   /* of independent coordinates on the way */
} kmp_search;

/** From q (n, closed, in the charts of linear->plant), which becomes the equilibrium; charts may be centred on the way.
 * `linear` is then taken there, its matrices with it, with independent coordinates that may be others than before.
 * KEMPE_E_FAILED: there is none, or it is not found, and why. q and rates are then as they were. */
kempe_status kmp_equilibrium_find(kmp_linear *linear, double t, double *q, kmp_search *search);

/** The same; where there is no rest, and nothing else is asked for, the steady motion that a start with the rates qd
 *  (n) leads to: what nothing depends on goes on at the rates at which R = 0. These are then in search->rates, to be
 *  freed by kmp_free. A note says so. */
kempe_status kmp_equilibrium_or_steady(kmp_linear *linear, double t, double *q, const double *qd, kmp_search *search);

/** Coordinates that nothing depends on, at the state and beside it, into `idle` (p): how many, -1: no memory. */
int kmp_equilibrium_idle(kmp_linear *linear, int *idle);

/** The residual of the last state, its matrices made. */
double kmp_equilibrium_residual(const kmp_linear *linear);

#endif
