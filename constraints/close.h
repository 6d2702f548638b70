/* SPDX-License-Identifier: BSD-3-Clause */
/* Newton's method on h(q, t) = 0: the one loop by which states are closed. Ways of correcting differ: the dependent
 * coordinates on the independent ones (constraints/reduction.h), along the mass-orthogonal direction
 * (constraints/saddle.h), by least moves (constraints/doctor_walk.h), along a led motion (analysis/sweep.h). */
#ifndef KMP_CONSTRAINTS_CLOSE_H
#define KMP_CONSTRAINTS_CLOSE_H

#include "constraints/plant.h"

/* A way of correcting x, whose first coordinates are q. */
typedef struct kmp_closer {
    void *self;
    kmp_plant *plant;
    const double *scale; /* of x */
    int count;           /* what is corrected */
    const int *at;       /* count: where it stands in x; NULL: from the first on */
    double *dx;          /* count: room */
    const int *rows;     /* those that are solved for, whose |h| counts; NULL: all that are to be met */
    int row_count;
    /** The plant's closure at (t, x) and what corrections take. 0; otherwise there are none. */
    int (*place)(void *self, double t, const double *x);
    /** dx with J dx = -violation (m values). false: there is none. */
    bool (*correct)(void *self, const double *violation, double *dx);
    /* Of corrections that are damped, of least |J dx + violation|^2 + |damping dx|^2, scaled; NULL: they are not.
     * `place` damps by |h|. */
    /** The same with more damping. 0; otherwise there are none. */
    int (*damp)(void *self, double damping);
    /** |h| that is left after the last correction where h is linear. */
    double (*promise)(void *self);
} kmp_closer;

/* When it is closed: a correction is within a fraction of the weights, or rounding; or |h| is rounding; or corrections
 * no longer shrink and |h| is `enough`. */
typedef struct kmp_close_rule {
    int most;         /* corrections */
    bool contracting; /* it has failed as soon as corrections no longer shrink */
    bool led;         /* x is to meet more than h, so that |h| says nothing while corrections shrink */
    double longest;   /* a longer correction is cut, scaled; 0: none is */
    bool least;       /* corrections come to nothing with h open, too: `enough` is asked for in any case */
    double enough;    /* scaled |h| */
    const double *w;  /* error weights of x; NULL: to round-off */
    double fraction;
    double seen; /* corrections that are longer count in `ratio` */
} kmp_close_rule;

typedef struct kmp_closed {
    bool closed;
    int corrections;
    double first, ratio; /* length of the first correction; of one to that before it at most */
} kmp_closed;

/** The plant's closure and the factors are then those of x to that accuracy. */
kmp_closed kmp_close(const kmp_closer *closer, const kmp_close_rule *rule, double t, double *x);

/** From afar, with corrections that are damped (Levenberg, Marquardt): each is as long as a bound allows, which shrinks
 * where |h| falls by less than promised. Until no row is open by more than `near`; otherwise x comes to rest where
 * nothing near makes |h| smaller, by the part `worth` of it at least, or after many corrections. Returns their number;
 * the plant's closure is then that of x. trial: n values of room. */
int kmp_close_from_afar(const kmp_closer *closer, double near, double worth, double t, double *x, double *trial);

/** Scaled |h| that is rounding where corrections no longer shrink, also of points far from the origin. */
double kmp_close_rounding(const kempe_system *system);

/** Rates brought to J qd + h_t = 0 with the factors at hand, twice for the sake of rounding, and again where damping
 * makes corrections shorter; room: m values. */
void kmp_close_rates(const kmp_closer *closer, double *room, double *qd);

/** q and qd brought to round-off. false: they are not closed. */
bool kmp_close_state(const kmp_closer *closer, double *room, double t, double *q, double *qd);

#endif
