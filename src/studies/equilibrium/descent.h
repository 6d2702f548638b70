/* SPDX-License-Identifier: BSD-3-Clause */
/* The way to an equilibrium: what its parts share. equilibrium.c goes down from afar, way_least.c is Newton's method by
 * damped least squares, with which all ways end; the state at hand, its unknowns and its measure are way.c. */
#ifndef KMP_STUDIES_EQUILIBRIUM_DESCENT_H
#define KMP_STUDIES_EQUILIBRIUM_DESCENT_H

#include "base/arena.h"
#include "studies/equilibrium/equilibrium.h"

#define KMP_WAY_BALANCED 1e-10 /* residual of an equilibrium */
#define KMP_WAY_FLAT     1e-11 /* an eigenvalue of the scaled Kr below is zero */

typedef struct kmp_descent {
    kmp_linear *l;
    kmp_search *search;
    kmp_arena arena; /* of all rooms */
    double t;
    int n;
    double *q;                          /* n: the state at hand */
    double *begin;                      /* n */
    double *given;                      /* what search->rates were */
    double *given_chart;                /* NULL: no joint is spherical */
    double *rates;                      /* p: ud */
    double *work;                       /* p: what acts and changes along each u, as work */
    double most;                        /* the largest of them */
    double residual, told;              /* scaled; as last noted */
    int count;                          /* unknowns, and as many equations R = 0 */
    int *place;                         /* count: where each stands in u */
    int *rate;                          /* count: whose rate of search->rates is unknown in place of the position; -1 */
    double *size;                       /* count: of a step's unknowns, their units */
    double *matrix, *vectors, *factors; /* count x count */
    double *values, *right;             /* count */
    double *step;                       /* count: of the unknowns, their units */
    double *force;                      /* p: R at the state at hand */
    double *move, *trial;               /* n */
    int *pivot;                         /* p */
    double least;                       /* least eigenvalue of the scaled Kr */
    bool flat;
    double bound;
    kempe_status status; /* of what is no mere failure to converge */
} kmp_descent;

bool kmp_way_init(kmp_descent *w);

/** Rates and charts are again what they were. */
void kmp_way_give_up(kmp_descent *w);

/** u_k in its characteristic size. */
double kmp_way_scale(const kmp_linear *l, int k);

/** The residual of a state whose matrices are made, all of R; `work` (p) is what each R_k is measured by. */
double kmp_way_measure(const kmp_linear *l, double *work, double *most);

/** The unit of unknown i: the characteristic size of a position; of a rate that in a second, or itself if larger. */
double kmp_way_unit(const kmp_descent *w, int i);

/** What unknown `column` changes of the equation of unknown `row`. */
double kmp_way_entry(const kmp_descent *w, int row, int column);

/** Chooses u at w->q, with the steady coordinates in it. */
kempe_status kmp_way_choose(kmp_descent *w);

/** The rates of the steady coordinates are others now. */
void kmp_way_take_rates(kmp_descent *w);

/** Takes l to q. false: it cannot be had. */
bool kmp_way_at(kmp_descent *w, const double *q);

/** Makes l's state and rates those at hand, with matrices, unknowns and measure: joints centred, u chosen anew where
 *  they have become bad. false: it cannot be had, or `status` says why. */
bool kmp_way_arrive(kmp_descent *w);

/** Moves joints whose angles are nearly singular into the middle of other charts: whether any was. */
bool kmp_way_center(kmp_descent *w);

void kmp_way_note(kmp_descent *w, double residual);
void kmp_way_note_step(kmp_descent *w, double step);

/** dq of the step in w->move, and how far it goes. */
double kmp_way_spread(kmp_descent *w);

/** Takes l to a part of the step. */
bool kmp_way_try(kmp_descent *w, double part);

/** Whether R does not change with u_k, to first order; `work` as kmp_way_measure gives it. */
bool kmp_way_is_idle(const kmp_linear *l, int k, const double *work);

/** Newton's method by damped least squares from the state at hand, with what w->search->exchange adds; then to
 * round-off. Where it fails l is anywhere. */
kempe_status kmp_way_least(kmp_descent *w);

kempe_status kmp_way_complain(const kmp_descent *w, const char *why);

#endif
