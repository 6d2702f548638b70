/* SPDX-License-Identifier: BSD-3-Clause */
/* Internals of Radau IIA with the stages of a step in the lanes of vector registers: control and dense output
 * (collocation.c), stages by Picard's or Newton's iteration (collocation_step.c), their choice (collocation_choice.c),
 * Newton's matrices for one Jacobian (collocation_newton.c) and for one of each stage (collocation_coupled.c).
 *
 * The unknowns of the stages are their derivatives g, without those of positions, which are rates, and of quadratures:
 *
 *     V = v + h A g,    Q = q + h c v + (h A)^2 g,    g = f(t + c h, Q, V). */
#pragma once

#include "integrators/steppers/collocation_table.h"
#include "integrators/steppers/solver.h"

/* Corrections that are combined, at most, less one. */
enum { KMP_COLLOCATION_MIXED = 6 };

/* Anderson's mixing of the corrections of an iteration (collocation_mixing.c). Arrays have inner x w numbers. */
typedef struct kmp_mixing {
    double *by[KMP_COLLOCATION_MIXED]; /* differences of corrections, orthonormal */
    double *to[KMP_COLLOCATION_MIXED]; /* those of the places that the corrections lead to */
    double *change, *place, *open;     /* the last correction, where it leads, what combinations leave of it */
    double size;                       /* the weighted square of the last correction */
    int count;                         /* of differences */
    bool on;
} kmp_mixing;

/* Iterations for the stages, by growing cost. */
typedef enum kmp_iteration {
    KMP_ITERATION_PICARD,
    KMP_ITERATION_NEWTON,  /* with one Jacobian for all stages */
    KMP_ITERATION_COUPLED, /* with a Jacobian for each stage */
    KMP_ITERATIONS
} kmp_iteration;

/* Parameters of an integrator of this family: radau, radau5, radau9. */
typedef struct kmp_collocation_method {
    int stages;             /* 0: as many as the lanes of the ODE have room for */
    kmp_iteration cheapest; /* that is tried */
    double part, power;     /* the estimate is compared with part rtol^power of the values */
    double rest;            /* iterations end at this part of rtol */
    bool by_rates; /* positions between steps by the rates of the stages, from an initial rate without its stiff part;
                    * otherwise by their derivatives and the initial rate, one order more accurate where nothing is
                    * stiff */
} kmp_collocation_method;

typedef struct kmp_collocation {
    kmp_solver base; /* first */
    const kmp_collocation_method *method;
    const kmp_collocation_table *table;
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
    double *lead, *lead_old;          /* inner: leading coefficients of the stages' polynomials, over their step */
    double *slip;                     /* n: of the rates of positions at the start of the last step, their stiff part */
    double *fix;                      /* n: the formulation's correction of the last step's end */
    double *g, *g_old;                /* (inner + q) w: derivatives of the stages; of the last step's */
    double *g_start, *g_start_old;    /* inner + q: at the start of the step, and of the last one */
    double *stage, *f;                /* n w: the stages and their derivatives */
    double *change, *g_before, *ends; /* inner w */
    double *at;                       /* w: times */
    double *c, *a, *aa;               /* w, s w, s w: columns of c, A and A A */
    double *once, *twice, *ahead;     /* s w, s w, (s + 1) w: columns of h A, (h A)^2, of the prediction */
    double *end;                      /* s w: columns of the table's sums at the end */
    double *decay, *decay_start;      /* s w and w: columns of the last Legendre coefficients */
    double decay_power;               /* the error's power of their ratio */
    double *one, *zero, *hc, *filter; /* w */
    double *jacobian;                 /* inner x (p + inner), column-major: df/dy without positions and quadratures */
    double *whole;                    /* n x n: that of the formulation; NULL: it has none */
    double *lu, *z, *into, *outof;    /* of Newton's method: factors, a right-hand side, eigenvectors */
    int *pivot;
    double *place; /* n */
    double *all;   /* the Jacobians of the stages, which are lanes; NULL, as the next five: their system is too large */
    double *coupled; /* the system of all stages, then its inverse; column-major */
    double *joint, *open, *at_prediction;
    int *coupled_pivot;
    kmp_mixing mixing;
    double h_matrix;        /* step size of the factors */
    double contraction;     /* of the last iteration */
    double unmixed;         /* the same of its first two corrections, which are not combined */
    double tried, expected; /* its step; the contraction in this attempt, by that of the one before */
    double picard;          /* estimate of the contraction of Picard's iteration by a correction of Newton's */
    double ready;           /* bound of the remainder of a correction, over its size */
    double error_old, h_old, ceiling;
    kmp_iteration iteration;
    kmp_iteration before;               /* on trial: the iteration to compare with */
    int trial_steps;                    /* until the judgement of a trial; 0: none */
    int limited, free;                  /* successive steps that the iteration has limited; that Picard's would not */
    int patience[KMP_ITERATIONS];       /* limited steps until a trial of that iteration */
    int trust;                          /* steps until a trial of a cheaper iteration */
    double cycles_before;               /* base.cycles at the end of the last step */
    double simulated[KMP_ITERATIONS];   /* time by each iteration in recent steps */
    double spent[KMP_ITERATIONS];       /* cycles of these steps */
    bool has_jacobian, fresh, factored; /* fresh: made in this step */
    int age, sweeps;                    /* steps since the Jacobian was made; sweeps of the last step */
    bool evaluated;                     /* f is known where the stages are predicted */
    bool near;                          /* the next sweeps are by kmp_ode.improve */
    int far, farther;                   /* steps without it: still, and after the last step that converged without */
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

/* collocation_newton.c */

/* collocation_coupled.c: the same for a Jacobian of each stage */

/* Cycles of a step besides its sweeps and matrices, and of a sweep for each unknown besides its evaluation, about. */
#define KMP_STEP_CYCLES             3900
#define KMP_SWEEP_CYCLES_OF_UNKNOWN 45
