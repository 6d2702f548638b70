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

/** Takes a correction s->change of g in a sweep, and combines it with those before where they fall slowly. Returns the
 * larger weighted square of the correction and of the combination. */
double kmp_collocation_mix(kmp_collocation *s, bool first);

/** The weighted square of x (inner x w). */
double kmp_collocation_square(const kmp_collocation *s, const double *x);

/** Evaluates f of s->stage at s->at in `count` lanes at least. */
int kmp_collocation_evaluate(kmp_collocation *s, int count);

/** Derivatives of the stages of a step h, in g, and the error's estimate with its weighted size. KMP_..._BAD_ITERATION:
 * *shorter is the part of h to try next. */
kmp_collocation_outcome kmp_collocation_find_stages(kmp_collocation *s, double h, double *error, double *shorter);

/** y at the end of that step, without the formulation's correction, into y_old. */
void kmp_collocation_end(kmp_collocation *s, double h);

/* collocation_newton.c */

/** Evaluates the Jacobian where the middle stage is predicted (s->stage, s->at), if there is none to be kept, and
 * factors the matrices of a step h. s->at, s->stage, s->f and s->change are lost. KMP_COLLOCATION_BAD_ITERATION: they
 * are singular. */
kmp_collocation_outcome kmp_collocation_prepare_newton(kmp_collocation *s, double h);

/** Factors the matrices of a step h with s->jacobian, if that has not been done. false: they are singular. */
bool kmp_collocation_factor(kmp_collocation *s, double h);

/** Turns the residuals in `change` into Newton's corrections. */
void kmp_collocation_correct_newton(kmp_collocation *s);

/** Removes the stiff part of the estimate in `error`. */
void kmp_collocation_filter(kmp_collocation *s);

/** The exact Jacobian at (t, y), without positions and quadratures. */
int kmp_collocation_take_exact(kmp_collocation *s, double t, const double *y, double *jacobian);

/** Changes unknown k, *x, for a difference; returns by how much. */
double kmp_collocation_displace(const kmp_collocation *s, int k, double *x);

/** Copies the predicted stage i; returns its time. */
double kmp_collocation_copy_stage(const kmp_collocation *s, int i, double *y);

/* collocation_coupled.c: the same for a Jacobian of each stage */

bool kmp_collocation_allocate_coupled(kmp_collocation *s);
kmp_collocation_outcome kmp_collocation_prepare_coupled(kmp_collocation *s, double h);
void kmp_collocation_correct_coupled(kmp_collocation *s);

/* Cycles of a step besides its sweeps and matrices, and of a sweep for each unknown besides its evaluation, about. */
#define KMP_STEP_CYCLES             3900
#define KMP_SWEEP_CYCLES_OF_UNKNOWN 45

/* collocation_choice.c */

/** Takes an iteration, without the experience of steps before. */
void kmp_collocation_begin_with(kmp_collocation *s, kmp_iteration iteration);

/** The longest step with a good contraction, by the one of a step h. With one Jacobian that is in proportion to the
 * longest way from there to a stage: half a step for a new one, a step more each time it is kept. */
double kmp_collocation_longest(kmp_collocation *s, double h);

/** Chooses the iteration of the next step, after one of length h that could be as long as `by_error` and
 * `by_iteration`. The next iteration is tried when this one has kept several steps far below the error's limit.
 * Picard's returns when it would contract well, one Jacobian for all stages after some time. */
void kmp_collocation_choose(kmp_collocation *s, double h, double by_error, double by_iteration);

/** True if further sweeps after a first one with a correction of this weighted size are by kmp_ode.improve: where that
 * is possible, and the places of the stages change little. */
bool kmp_collocation_is_near(const kmp_collocation *s, double size);

/** After a step that converged by f alone, and not by such sweeps: makes some steps without them, twice as many each
 * time. */
void kmp_collocation_go_far(kmp_collocation *s);

/** True if corrections with the present Jacobian cost less in the next step than a new one and its corrections. */
bool kmp_collocation_keeps_jacobian(const kmp_collocation *s);

/** True if all stages are evaluated at once. */
bool kmp_collocation_in_lanes(const kmp_collocation *s);

/** About the processor cycles of an evaluation of all stages, of Newton's corrections by an iteration, of a renewal of
 * its matrices without evaluations, and of a Jacobian. */
double kmp_collocation_sweep_cost(const kmp_collocation *s);
double kmp_collocation_correction_cost(const kmp_collocation *s, kmp_iteration iteration);
double kmp_collocation_matrix_cost(const kmp_collocation *s, kmp_iteration iteration);
double kmp_collocation_jacobian_cost(const kmp_collocation *s);
