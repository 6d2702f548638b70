/* SPDX-License-Identifier: BSD-3-Clause */
/* Internals of Radau IIA with the stages of a step in the lanes of vector registers: control and dense output
 * (collocation.c), stages by Picard's or Newton's iteration (collocation_step.c), Newton's matrices
 * (collocation_newton.c).
 *
 * The unknowns of the stages are their derivatives g, without those of positions, which are rates, and of quadratures:
 *
 *     V = v + h A g,    Q = q + h c v + (h A)^2 g,    g = f(t + c h, Q, V). */
#ifndef KMP_INTEGRATORS_STEPPERS_COLLOCATION_H
#define KMP_INTEGRATORS_STEPPERS_COLLOCATION_H

#include "integrators/steppers/collocation_table.h"
#include "integrators/steppers/solver.h"

typedef struct kmp_collocation {
    kmp_solver base; /* first */
    kmp_collocation_table table;
    int n, s, w;     /* unknowns, stages, lanes: s <= w */
    int p, inner, q; /* unknowns: positions, those with stage derivatives, quadratures */
    double widen;    /* weights of the estimate over those of the tolerance */
    double limit;    /* remainder of a correction at which an iteration stops */
    int most_sweeps;
    double taken;                     /* the last step */
    double *y, *y_old, *dy, *dy_new;  /* n; dy = f(t, y) */
    double *trial, *slope;            /* n */
    double *scale, *per_scale;        /* n: weights of the estimate, and their inverse */
    double *w_accept;                 /* n: weights of the tolerance */
    double *error;                    /* n: of the attempt */
    double *weight;                   /* inner: of a change of g in the norm */
    double *fix;                      /* n: the formulation's correction of the last step's end */
    double *g, *g_old;                /* (inner + q) w: derivatives of the stages; of the last step's */
    double *g_start, *g_start_old;    /* inner + q: at the start of the step, and of the last one */
    double *stage, *f;                /* n w: the stages and their derivatives */
    double *change, *g_before, *ends; /* inner w */
    double *at;                       /* w: times */
    double *c, *a, *aa;               /* w, s w, s w: columns of c, A and A A */
    double *once, *twice, *ahead;     /* s w, s w, (s + 1) w: columns of h A, (h A)^2, of the prediction */
    double *end;                      /* s w: columns of the table's sums at the end */
    double *one, *zero, *hc, *filter; /* w */
    double *jacobian;                 /* inner x (p + inner), column-major: df/dy without positions and quadratures */
    double *whole;                    /* n x n: that of the formulation; NULL: it has none */
    double *lu, *z, *into, *outof;    /* of Newton's method: factors, a right-hand side, eigenvectors */
    int *pivot;
    double *place;   /* n */
    double *all;     /* s Jacobians; NULL, as the next three: the system of all stages is too large */
    double *coupled; /* system of all stages */
    double *joint;   /* its right-hand side */
    int *coupled_pivot;
    double h_matrix;    /* step size of the factors */
    double contraction; /* of the last iteration */
    double picard;      /* estimate of the contraction of Picard's iteration by a correction of Newton's */
    double ready;       /* bound of the remainder of a correction, over its size */
    double error_old, h_old, ceiling;
    int limited, free;         /* successive steps that Picard's iteration has limited; that it would not */
    int patience, trial_steps; /* of Picard's iteration until a trial of Newton's method; steps until its judgement */
    double pace, pace_before;  /* time simulated for an evaluation of all stages; of the iteration before */
    long rhs_before;
    bool together;      /* Newton's method has a Jacobian for each stage */
    bool newton_limits; /* it has rejected a longer step than the one taken */
    int trust, doubt;   /* steps until one Jacobian for all stages is tried again; their number the next time */
    bool newton, has_jacobian, fresh, factored;
    bool first, rejected, has_step, collapsed;
} kmp_collocation;

/* Result of an attempt. */
typedef enum kmp_collocation_outcome {
    KMP_COLLOCATION_TAKEN,
    KMP_COLLOCATION_BAD_ERROR,
    KMP_COLLOCATION_BAD_STAGE,
    KMP_COLLOCATION_BAD_ITERATION,
    KMP_COLLOCATION_BAD_STEP,
    KMP_COLLOCATION_HALTED
} kmp_collocation_outcome;

/** Evaluates f of s->stage at s->at in `count` lanes at least. */
int kmp_collocation_evaluate(kmp_collocation *s, int count);

/** Derivatives of the stages of a step h, in g, and the error's estimate with its weighted size. KMP_..._BAD_ITERATION:
 * *shorter is the part of h to try next. */
kmp_collocation_outcome kmp_collocation_find_stages(kmp_collocation *s, double h, double *error, double *shorter);

/** y at the end of that step, without the formulation's correction, into y_old. */
void kmp_collocation_end(kmp_collocation *s, double h);

/* collocation_newton.c */

/** Allocates the arrays of Newton's method. */
bool kmp_collocation_allocate_newton(kmp_collocation *s);

/** Evaluates Jacobians where the stages are predicted (s->stage, s->at), if there are none to be kept, and factors the
 * matrices of a step h. s->at, s->stage, s->f and s->change are lost. */
kmp_collocation_outcome kmp_collocation_prepare_newton(kmp_collocation *s, double h);

/** Turns the residuals in `change` into Newton's corrections. */
void kmp_collocation_correct(kmp_collocation *s);

/** Removes the stiff part of the estimate in `error`. */
void kmp_collocation_filter(kmp_collocation *s);

#endif
