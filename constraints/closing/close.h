/* SPDX-License-Identifier: BSD-3-Clause */
/* Newton's method on h(q, t) = 0, the one loop that closes states. The corrections differ: the dependent coordinates
 * for given independent ones (constraints/partition/reduction.h), the mass-orthogonal direction
 * (constraints/closing/saddle.h), least changes (constraints/closing/random_walk.h), or a swept motion
 * (analyses/kinematics/sweep.h). */
#pragma once

#include "constraints/evaluation/evaluator.h"
#include "constraints/partition/reduction.h"
#include "integrators/decide/closing.h"

/* A method of correcting x, whose first coordinates are q. */
typedef struct kmp_closer {
    void *self;
    kmp_evaluator *eval;
    const double *scale; /* of x */
    int count;           /* number of corrected entries of x */
    const int *at;       /* count: their indices in x; NULL: the first ones */
    double *dx;          /* count: work space */
    const int *rows;     /* rows to be solved, whose |h| counts; NULL: all rows that are to be met */
    int row_count;
    /** Evaluates the evaluator's closure at (t, x), as `place` does, for kmp_close_from_afar; NULL: kmp_eval_closure.
     */
    void (*evaluate)(void *self, double t, const double *x);
    /** Evaluates the evaluator's closure at (t, x) and prepares corrections. Returns 0, or nonzero if there are none.
     */
    int (*place)(void *self, double t, const double *x);
    /** Finds dx with J dx = -violation (m values). false: there is none. */
    bool (*correct)(void *self, const double *violation, double *dx);
    /* Damped corrections minimise |J dx + violation|^2 + |damping dx|^2, scaled; NULL: corrections are undamped.
     * `place` damps by |h|. */
    /** Factors with larger damping. Returns 0, or nonzero if there is no correction. */
    int (*damp)(void *self, double damping);
    /** Returns the |h| that the linear model predicts after the last correction. */
    double (*promise)(void *self);
} kmp_closer;

/** Closes x. The evaluator's closure and the factors then belong to x to that accuracy. */
kmp_closed kmp_close(const kmp_closer *closer, const kmp_close_rule *rule, double t, double *x);

/** Closes from a distant guess with damped corrections (Levenberg, Marquardt). Their length has a bound, which
 * shrinks where |h| falls by less than predicted. Ends when no row is open by more than `near`, when no correction
 * reduces |h| by the part `worth`, or after many corrections. Returns their number; the evaluator's closure then
 * belongs to x. trial: n values of work space. */
int kmp_close_from_afar(const kmp_closer *closer, double near, double worth, double t, double *x, double *trial);

/** |h| of the evaluator's last closure: the root of the sum of squares of the rows that count, scaled. */
double kmp_close_length(const kmp_evaluator *eval);

/** Scaled |h| that is rounding where corrections no longer shrink, also of points far from the origin. */
double kmp_close_rounding(const kempe_system *system);

/** Corrects rates to J qd + h_t = 0 with the present factors: twice because of rounding, and repeatedly where
 * damping shortens corrections. room: m values. */
void kmp_close_rates(const kmp_closer *closer, double *room, double *qd);

/** Brings q and qd to round-off. false: they are not closed. */
bool kmp_close_state(const kmp_closer *closer, double *room, double t, double *q, double *qd);

/** Closes v of q for its u by Newton's method from the given v, with a new Jacobian in each iteration. Ends when a
 * correction is within `fraction` of the weights w (n; NULL: to round-off). The evaluator's closure and the factors
 * then belong to q to that accuracy. 0; 1 when corrections no longer contract or Jv is singular. */
kmp_close_rule kmp_reduction_close_rule(const kmp_reduction *red); /* to round-off */
int kmp_reduction_close(kmp_reduction *red, double t, double *q, const double *w, double fraction);
