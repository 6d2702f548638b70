/* SPDX-License-Identifier: BSD-3-Clause */
/* The way to an equilibrium: what its parts share. equilibrium.c goes down from afar, way_near.c ends by Newton's
 * method, way_exchange.c goes where unknowns are exchanged; the state at hand and its measure are way.c. */
#ifndef KMP_ANALYSIS_WAY_H
#define KMP_ANALYSIS_WAY_H

#include "analysis/equilibrium.h"

#define KMP_WAY_BALANCED 1e-10 /* residual of an equilibrium */
#define KMP_WAY_FLAT     1e-11 /* an eigenvalue of the scaled Kr below is zero */

typedef struct kmp_way {
    kmp_linear *l;
    kmp_search *search;
    double t;
    int n;
    double *q;             /* n: the state at hand */
    double *begin;         /* n */
    double *rates;         /* p: ud */
    double *work;          /* p: what acts and changes along each u, as work */
    double most;           /* the largest of them */
    double residual, told; /* scaled; as last noted */
    double *size;          /* p: of a step's unknowns, coordinate units */
    double *matrix, *vectors;
    double *values, *right;        /* p */
    double *step, *force;          /* p: of u, and R there */
    double *move, *trial;          /* n */
    int *pivot, *active;           /* p */
    int active_count, active_seen; /* matrices that KINSOL asked for */
    double least;                  /* least eigenvalue of the scaled Kr */
    bool flat;
    double bound;
    kempe_status status; /* of what is no mere failure to converge */
} kmp_way;

bool kmp_way_init(kmp_way *w);
void kmp_way_free(kmp_way *w);

/** u_k in its characteristic size. */
double kmp_way_scale(const kmp_linear *l, int k);

/** The residual of the last state, its matrices made; `work` (p) is what each R_k is measured by. */
double kmp_way_measure(const kmp_linear *l, double *work, double *most);

/** Chooses u at q, with the steady coordinates in it. */
kempe_status kmp_way_choose(kmp_way *w);

/** The rates of the steady coordinates are others now. */
void kmp_way_take_rates(kmp_way *w);

/** Takes l to q. false: it cannot be had. */
bool kmp_way_at(kmp_way *w, const double *q);

/** Makes l's state the one at hand, with its matrices and measure: joints centred, u chosen anew where they have become
 *  bad. false: it cannot be had, or `status` says why. */
bool kmp_way_arrive(kmp_way *w);

/** Moves joints whose angles are nearly singular into the middle of other charts: whether any was. */
bool kmp_way_center(kmp_way *w);

void kmp_way_note(kmp_way *w, double residual);
void kmp_way_note_step(kmp_way *w, double step);

/** The scaled Kr, and the eigenvectors and values of its symmetric part. false: no memory. */
bool kmp_way_decompose(kmp_way *w);

/** The step in w->step: Newton's, or one of which R says that it leads down; along flat directions that nothing pulls
 * it stands still. */
bool kmp_way_direction(kmp_way *w, bool down);

/** dq of the step in w->move, and how far it goes. */
double kmp_way_spread(kmp_way *w);

/** Takes l to a part of the move. */
bool kmp_way_try(kmp_way *w, double part);

/** Whether R does not change with u_k, to first order; `work` as kmp_way_measure gives it. */
bool kmp_way_is_idle(const kmp_linear *l, int k, const double *work);

/** KINSOL from the state at hand; where it fails that stays. */
kempe_status kmp_way_newton(kmp_way *w);

/** Newton's steps as they are, while the residual falls. */
void kmp_way_polish(kmp_way *w);

/** Where unknowns are exchanged: w->search->exchange. */
kempe_status kmp_way_exchange(kmp_way *w);

kempe_status kmp_way_complain(const kmp_way *w, const char *why);

#endif
