/* SPDX-License-Identifier: BSD-3-Clause */
/* Common definitions of the search for an equilibrium. equilibrium_study.c descends from afar, descent_least.c is
 * Newton's method by damped least squares, with which all searches end. The current state, its unknowns and its measure
 * are in descent.c. */
#pragma once

#include "base/arena.h"
#include "studies/equilibrium/contact_set.h"
#include "studies/equilibrium/equilibrium_study.h"

#define KMP_WAY_BALANCED 1e-10 /* residual of an equilibrium */
#define KMP_WAY_FLAT     1e-11 /* an eigenvalue of the scaled Kr below is zero */

typedef struct kmp_descent {
    kmp_linear *l;
    kmp_search *search;
    kmp_arena arena;           /* of all arrays */
    kmp_contact_set *contacts; /* NULL: none */
    double t;
    int n;
    double *q;                 /* n: the current state */
    double *begin;             /* n */
    double *given;             /* original values of search->rates */
    double *given_chart;       /* NULL: no joint is spherical */
    double *rates;             /* p: ud */
    double *work;              /* p: forces and their changes along each u, as work */
    double most;               /* the largest of them */
    double residual, reported; /* scaled; as last noted */
    int count;                 /* unknowns, and as many equations R = 0 */
    int *place;                /* count: the index of each unknown in u */
    int *rate;                 /* count: the entry of search->rates that is unknown in place of the position; -1 */
    double *size;              /* count: of a step's unknowns, their units */
    double *matrix, *vectors, *factors; /* count x count */
    double *values, *right;             /* count */
    double *step;                       /* count: of the unknowns, their units */
    double *force;                      /* p: R at the current state */
    double *move, *trial;               /* n */
    int *pivot;                         /* p */
    double least;                       /* least eigenvalue of the scaled Kr */
    bool flat;
    double bound;
    kempe_status status; /* of errors other than failure to converge */
} kmp_descent;

bool kmp_descent_init(kmp_descent *w);

/** Restores rates and charts. */
void kmp_descent_give_up(kmp_descent *w);

/** u_k in its characteristic size. */
double kmp_descent_scale(const kmp_linear *l, int k);

/** The residual of a state whose matrices are made, all of R; `work` (p) receives the reference of each R_k. */
double kmp_descent_measure(const kmp_linear *l, double *work, double *most);

/** The unit of unknown i: the characteristic size of a position; for a rate one such size per second, or the rate
 * itself if larger. */
double kmp_descent_unit(const kmp_descent *w, int i);

/** The derivative of the equation of unknown `row` by unknown `column`. */
double kmp_descent_entry(const kmp_descent *w, int row, int column);

/** Chooses u at w->q, with the steady coordinates in it. */
kempe_status kmp_descent_choose(kmp_descent *w);

/** The rates of the steady coordinates are others now. */
void kmp_descent_take_rates(kmp_descent *w);

/** Takes l to q. False: impossible. */
bool kmp_descent_at(kmp_descent *w, const double *q);

/** Makes l's state and rates the current ones, with matrices, unknowns and measure: joints centred, u chosen again
 * where it has become ill-conditioned. False: the state is impossible, or `status` gives the reason. */
bool kmp_descent_arrive(kmp_descent *w);

/** Closes and opens contacts at w->q as their set is now, and makes that state the current one. False: as
 * kmp_descent_arrive. */
bool kmp_descent_press(kmp_descent *w);

/** Moves joints whose angles are nearly singular into the middle of other charts; true if any was moved. */
bool kmp_descent_center(kmp_descent *w);

void kmp_descent_note(kmp_descent *w, double residual);
void kmp_descent_note_step(kmp_descent *w, double step);

/** dq of the step in w->move; returns its length. */
double kmp_descent_spread(kmp_descent *w);

/** Takes l to a part of the step. */
bool kmp_descent_try(kmp_descent *w, double part);

/** True if R does not change with u_k, to first order, and u_k is not the motion of a state; `work` as from
 * kmp_descent_measure. */
bool kmp_descent_is_idle(const kmp_linear *l, int k, const double *work);

/** Newton's method by damped least squares from the current state, with the additions of w->search->exchange; then to
 * round-off. After a failure the state of l is undefined. */
kempe_status kmp_descent_least(kmp_descent *w);

kempe_status kmp_descent_complain(const kmp_descent *w, const char *why);

/** Appends the forces along u[k] of the last state: "gravity -9.81 N, 'k' 2 N, together -7.81 N", the nonzero ones,
 * largest first; nothing where there are none. KEMPE_E_MEMORY. */
kempe_status kmp_load_path_report(kmp_text *text, const kmp_linear *linear, int k);
