/* SPDX-License-Identifier: BSD-3-Clause */
/* Newton's method on h(q, t) = 0: the one loop by which states are closed. Ways of correcting differ: the dependent
 * coordinates on the independent ones (constraints/partition/reduction.h), along the mass-orthogonal direction
 * (constraints/closing/saddle.h), by least moves (constraints/diagnosis/doctor_walk.h), along a led motion
 * (analysis/sweep.h). */
#ifndef KMP_CONSTRAINTS_CLOSING_CLOSE_H
#define KMP_CONSTRAINTS_CLOSING_CLOSE_H

#include "constraints/evaluation/plant.h"

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
    /* Damped corrections minimise |J dx + violation|^2 + |damping dx|^2, scaled; NULL: corrections are undamped.
     * `place` damps by |h|. */
    /** Factors with larger damping. Returns 0, or nonzero if there is no correction. */
    int (*damp)(void *self, double damping);
    /** Returns the |h| that the linear model predicts after the last correction. */
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

/** Closes from a distant guess with damped corrections (Levenberg, Marquardt). Their length has a bound, which
 * shrinks where |h| falls by less than predicted. Ends when no row is open by more than `near`, when no correction
 * reduces |h| by the part `worth`, or after many corrections. Returns their number; the plant's closure is then
 * that of x. trial: n values of work space. */
int kmp_close_from_afar(const kmp_closer *closer, double near, double worth, double t, double *x, double *trial);

/** |h| of the plant's last closure: the root of the sum of squares of the rows that count, scaled. */
double kmp_close_length(const kmp_plant *plant);

/** Scaled |h| that is rounding where corrections no longer shrink, also of points far from the origin. */
double kmp_close_rounding(const kempe_system *system);

/** Corrects rates to J qd + h_t = 0 with the present factors: twice because of rounding, and repeatedly where
 * damping shortens corrections. room: m values. */
void kmp_close_rates(const kmp_closer *closer, double *room, double *qd);

/** q and qd brought to round-off. false: they are not closed. */
bool kmp_close_state(const kmp_closer *closer, double *room, double t, double *q, double *qd);

#endif
