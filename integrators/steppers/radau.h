/* SPDX-License-Identifier: BSD-3-Clause */
/* The inside of Radau IIA: steps and their control (radau.c) on stages found by Newton (radau_stages.c). */
#ifndef KMP_INTEGRATORS_STEPPERS_RADAU_H
#define KMP_INTEGRATORS_STEPPERS_RADAU_H

#include "base/arena.h"
#include "integrators/steppers/radau_method.h"
#include "integrators/steppers/solver.h"

/* Factors of g / h - J, of what is left of it when the first unknowns, whose derivatives are unknowns too, and the
 * last, which nothing depends on, are eliminated. */
typedef struct kmp_radau_block {
    double *re, *im; /* im NULL: g is real */
    int *pivot;
    double g_re, g_im; /* g / h */
} kmp_radau_block;

typedef struct kmp_radau {
    kmp_solver base; /* first */
    kmp_ode ode;
    kmp_tolerance tolerance;
    kmp_radau_method method;
    int n, s, p, inner; /* unknowns, stages, positions, size of the linear systems */
    double widen;       /* weights of the estimate by those of the tolerance */
    double limit;       /* what is left of a correction at which Newton stops */
    int most_iterations;
    double taken;                        /* the last step */
    double *y, *y_old, *dy, *trial;      /* n; dy = f(t, y) */
    double *scale, *w;                   /* n: weights of the estimate, of the tolerance */
    double *error, *bend;                /* n: of the attempt; of the last step's polynomial */
    double *lead, *lead_old;             /* n: leading coefficients of the polynomials */
    double *z[KMP_RADAU_MAX_STAGES];     /* stages less y */
    double *z_old[KMP_RADAU_MAX_STAGES]; /* of the last step */
    double *u[KMP_RADAU_MAX_STAGES];     /* T^-1 z */
    double *f[KMP_RADAU_MAX_STAGES];     /* right-hand sides */
    double *change[KMP_RADAU_MAX_STAGES];
    double *jacobian[KMP_RADAU_MAX_STAGES]; /* n x n: at y in the first, or of each stage */
    kmp_radau_block real, complex[KMP_RADAU_MAX_PAIRS];
    double *coupled; /* of all stages together; NULL: too many */
    double *joint;   /* its right-hand side */
    int *coupled_pivot;
    bool together;      /* by Jacobians of each stage */
    double h_matrix;    /* of the factors */
    double contraction; /* of the last Newton iteration */
    double ready;       /* bound for what is left of a correction, by its size */
    double error_old, h_old;
    bool first, rejected, has_step, has_jacobian, fresh, factored, collapsed;
    bool held;           /* Newton has refused a longer step than the one taken */
    int trust, patience; /* steps until one Jacobian for all stages is tried again; how many the next time */
    kmp_arena arena;     /* of all arrays */
} kmp_radau;

/* What became of an attempt. */
typedef enum kmp_radau_outcome {
    KMP_RADAU_TAKEN,
    KMP_RADAU_BAD_ERROR,
    KMP_RADAU_BAD_STAGE,
    KMP_RADAU_BAD_NEWTON,
    KMP_RADAU_BAD_STEP,
    KMP_RADAU_HALTED
} kmp_radau_outcome;

/** dy = f(t, y), counted. */
int kmp_radau_call(kmp_radau *s, double t, const double *y, double *dy);

/** Stages of a step h in z. KMP_RADAU_BAD_NEWTON: *shorter is the part of h to try next. */
kmp_radau_outcome kmp_radau_find_stages(kmp_radau *s, double h, double *shorter);

/** x <- (g / h - J)^-1 x, with the factors of the stages. */
void kmp_radau_filter(const kmp_radau *s, double *x);

/** y of the last step at t_old + x taken, less y at its end. */
void kmp_radau_extrapolate(const kmp_radau *s, double x, double *z);

#endif
