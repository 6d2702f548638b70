/* SPDX-License-Identifier: BSD-3-Clause */
/* Internals of Radau IIA: steps and their control (radau.c) on stages solved by Newton's method (radau_stages.c). */
#ifndef KMP_INTEGRATORS_STEPPERS_RADAU_H
#define KMP_INTEGRATORS_STEPPERS_RADAU_H

#include "integrators/steppers/radau_method.h"
#include "integrators/steppers/solver.h"

/* Factors of g / h - J after elimination of the first unknowns, whose derivatives are unknowns too, and of the last, on
 * which nothing depends. */
typedef struct kmp_radau_block {
    double *re, *im; /* im NULL: g is real */
    int *pivot;
    double g_re, g_im; /* g / h */
} kmp_radau_block;

typedef struct kmp_radau {
    kmp_solver base; /* first */
    const kmp_radau_method *method;
    int n, s, p, inner; /* unknowns, stages, positions, size of the linear systems */
    double widen;       /* weights of the estimate over those of the tolerance */
    double limit;       /* remainder of a correction at which Newton's method stops */
    int most_iterations;
    double taken;                        /* the last step */
    double *y, *y_old, *dy, *trial;      /* n; dy = f(t, y) */
    double *scale, *w;                   /* n: weights of the estimate; of the tolerance */
    double *error, *factor;              /* n: of the attempt; of the last step's polynomial */
    double *lead, *lead_old;             /* n: leading coefficients of the polynomials */
    double *z[KMP_RADAU_MAX_STAGES];     /* stages minus y */
    double *z_old[KMP_RADAU_MAX_STAGES]; /* stages minus y of the last step */
    double *u[KMP_RADAU_MAX_STAGES];     /* T^-1 z */
    double *f[KMP_RADAU_MAX_STAGES];     /* right-hand sides */
    double *change[KMP_RADAU_MAX_STAGES];
    double *jacobian[KMP_RADAU_MAX_STAGES]; /* n x n: at y in the first, or one for each stage */
    kmp_radau_block real, complex[KMP_RADAU_MAX_PAIRS];
    double *coupled; /* system of all stages; NULL: too large */
    double *joint;   /* its right-hand side */
    int *coupled_pivot;
    bool together;      /* with Jacobians of each stage */
    double h_matrix;    /* step size of the factors */
    double contraction; /* of the last Newton iteration */
    double ready;       /* bound of the remainder of a correction, over its size */
    double error_old, h_old;
    bool first, rejected, has_step, has_jacobian, fresh, factored, collapsed;
    bool newton_limits;  /* Newton's method has rejected a longer step than the one taken */
    int trust, patience; /* steps until one Jacobian for all stages is tried again; their number the next time */
} kmp_radau;

/* Result of an attempt. */
typedef enum kmp_radau_outcome {
    KMP_RADAU_TAKEN,
    KMP_RADAU_BAD_ERROR,
    KMP_RADAU_BAD_STAGE,
    KMP_RADAU_BAD_NEWTON,
    KMP_RADAU_BAD_STEP,
    KMP_RADAU_HALTED
} kmp_radau_outcome;

/** Stages of a step h in z. KMP_RADAU_BAD_NEWTON: *shorter is the part of h to try next. */
kmp_radau_outcome kmp_radau_find_stages(kmp_radau *s, double h, double *shorter);

/** x <- (g / h - J)^-1 x, with the factors of the stages. */
void kmp_radau_filter(const kmp_radau *s, double *x);

/** y of the last step at t_old + x taken, minus y at its end. */
void kmp_radau_extrapolate(const kmp_radau *s, double x, double *z);

#endif
