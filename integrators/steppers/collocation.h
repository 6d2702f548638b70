/* SPDX-License-Identifier: BSD-3-Clause */
/* Internals of Radau IIA with the stages of a step in the lanes of vector registers: control, choice
 * of an iteration and dense output (collocation.c), stages by Picard's or Newton's iteration (collocation_step.c),
 * Newton's matrices for one Jacobian and for one of each stage (collocation_newton.c).
 *
 * The unknowns of the stages are their derivatives g, without derivatives of positions, which are rates, and of
 * quadratures:
 *
 *     V = v + h A g,    Q = q + h c v + (h A)^2 g,    g = f(t + c h, Q, V). */
#pragma once

#include "integrators/steppers/collocation_table.h"
#include "integrators/steppers/solver.h"

/* Corrections that are combined, at most, less one. */
enum { KMP_COLLOCATION_MIXED = 6 };

/* Anderson's mixing of the corrections of an iteration (collocation_newton.c). Arrays have inner x w numbers. */
typedef struct kmp_mixing {
    double *by[KMP_COLLOCATION_MIXED]; /* differences of corrections, orthonormal */
    double *to[KMP_COLLOCATION_MIXED]; /* differences of the places that the corrections lead to */
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

/* Newton's method with one Jacobian for all stages. */
typedef struct kmp_newton_stages {
    double *jacobian;              /* inner x (p + inner), column-major: df/dy without positions and quadratures */
    double *whole;                 /* n x n: the Jacobian of the formulation; NULL: it has none */
    double *lu, *z, *into, *outof; /* factors, a right-hand side, eigenvectors */
    int *pivot;
    double *place;                      /* n: where the Jacobian is evaluated */
    double h_matrix;                    /* step size of the factors */
    bool has_jacobian, fresh, factored; /* fresh: made in this step */
    int age;                            /* steps since the Jacobian was made */
} kmp_newton_stages;

/* Newton's method with a Jacobian of each stage. */
typedef struct kmp_coupled_stages {
    double *all;    /* the Jacobians of the stages, which are lanes; NULL, as the others: their system is too large */
    double *system; /* the system of all stages, then its inverse; column-major */
    double *joint, *open, *at_prediction;
    int *pivot;
} kmp_coupled_stages;

/* The choice of an iteration, by recent steps. */
typedef struct kmp_iteration_choice {
    kmp_iteration before;             /* on trial: the iteration to compare with */
    int trial_steps;                  /* until the judgement of a trial; 0: none */
    int limited, free;                /* successive steps that the iteration has limited; that Picard's would not */
    int patience[KMP_ITERATIONS];     /* limited steps until a trial of that iteration */
    int trust;                        /* steps until a trial of a cheaper iteration */
    double cycles_before;             /* base.cycles at the end of the last step */
    double simulated[KMP_ITERATIONS]; /* time by each iteration in recent steps */
    double spent[KMP_ITERATIONS];     /* cycles of these steps */
    double picard; /* estimate of the contraction of Picard's iteration by a correction of Newton's */
} kmp_iteration_choice;

/* The numbers of the table in lanes, with the step: column by column. */
typedef struct kmp_table_lanes {
    double *at;                       /* w: times */
    double *c, *a, *aa;               /* w, s w, s w: columns of c, A and A A */
    double *once, *twice, *ahead;     /* s w, s w, (s + 1) w: columns of h A, (h A)^2, of the prediction */
    double *end;                      /* s w: columns of the table's sums at the end */
    double *decay, *decay_start;      /* s w and w: columns of the last Legendre coefficients */
    double decay_power;               /* the error's power of their ratio */
    double *one, *zero, *hc, *filter; /* w */
} kmp_table_lanes;

/* Measures of earlier steps, by which the next one is chosen. */
typedef struct kmp_past_steps {
    double contraction;     /* of the last iteration */
    double unmixed;         /* the same of its first two corrections, which are not combined */
    double tried, expected; /* its step; the contraction in this attempt, by the contraction of the one before */
    double error, h;        /* of the last step; 0: of none */
    double ceiling;
} kmp_past_steps;

typedef struct kmp_collocation {
    kmp_solver base; /* first */
    const kmp_collocation_method *method;
    const kmp_collocation_table *table;
    int n, s, w;     /* unknowns, stages, lanes: s <= w */
    int p, inner, q; /* unknowns: positions, unknowns with stage derivatives, quadratures */
    int columns;     /* of linear equations that follow (kmp_ode.followers), in all_p and all, not in p and inner */
    int all_p, all;  /* all positions, which come first; all with stage derivatives, behind them */
    double widen;    /* weights of the estimate over the weights of the tolerance */
    double limit;    /* remainder of a correction at which an iteration stops */
    double limit_of_columns;
    int most_sweeps;
    double taken;                    /* the last step */
    double *y, *y_old, *dy, *dy_new; /* n; dy = f(t, y) */
    double *trial, *slope;           /* n */
    double *scale, *per_scale;       /* n: weights of the estimate, and their inverse */
    double *w_accept;                /* n: weights of the tolerance */
    double *error;                   /* n: of the attempt */
    double *weight;                  /* inner: of a change of g in the norm */
    double *lead, *lead_old;         /* all: leading coefficients of the stages' polynomials, over their step */
    double *slip;                    /* n: of the rates of positions at the start of the last step, their stiff part */
    double *fix;                     /* n: the formulation's correction of the last step's end */
    double *g, *g_old;               /* (all + q) w: derivatives of the stages; of the last step's */
    double *g_start, *g_start_old;   /* all + q: at the start of the step, and of the last one */
    double *stage, *f;               /* n w: the stages and their derivatives */
    double *change, *g_before;       /* all w */
    double *ends;                    /* (all + q) w */
    double *of_motion, *of_parameters; /* of the equations that follow: A, b, in lanes */
    kmp_table_lanes lanes;
    kmp_newton_stages newton;
    kmp_coupled_stages coupled;
    kmp_mixing mixing;
    kmp_past_steps past;
    double ready; /* bound of the remainder of a correction, over its size */
    kmp_iteration iteration;
    kmp_iteration_choice choice;
    int sweeps;       /* of the last step */
    bool evaluated;   /* f is known where the stages are predicted */
    bool near;        /* the next sweeps are by kmp_ode.improve */
    int far, farther; /* steps without it: still, and after the last step that converged without */
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

/* Cycles of a step besides its sweeps and matrices, and of a sweep for each unknown besides its evaluation, about. */
#define KMP_STEP_CYCLES             3900
#define KMP_SWEEP_CYCLES_OF_UNKNOWN 45

/* The place of unknown c of the iteration, positions first, among all. */
static inline int kmp_collocation_unknown(const kmp_collocation *s, int c)
{
    return c < s->p ? c : s->all_p - s->p + c;
}

/** Takes an iteration, without the experience of steps before. */
void kmp_collocation_begin_with(kmp_collocation *s, kmp_iteration iteration);

/** True if further sweeps after a first one with a correction of this weighted size are by kmp_ode.improve: where that
 * is possible, and the places of the stages change little. */
bool kmp_collocation_is_near(const kmp_collocation *s, double size);

/** After a step that converged only by f, and not by such sweeps: makes some steps without them, twice as many each
 * time. */
void kmp_collocation_go_far(kmp_collocation *s);

/** True if all stages are evaluated at once. */
bool kmp_collocation_in_lanes(const kmp_collocation *s);

/** About the processor cycles of an evaluation of all stages, of Newton's corrections by an iteration, of a renewal of
 * its matrices without evaluations, and of a Jacobian. */
double kmp_collocation_sweep_cost(const kmp_collocation *s);
double kmp_collocation_correction_cost(const kmp_collocation *s, kmp_iteration iteration);
double kmp_collocation_matrix_cost(const kmp_collocation *s, kmp_iteration iteration);
double kmp_collocation_jacobian_cost(const kmp_collocation *s);
