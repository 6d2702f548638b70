/* SPDX-License-Identifier: BSD-3-Clause */
/* Coefficients of Radau IIA of any number of stages s for unknown derivatives of the stages: collocation at the zeros c
 * of a Radau polynomial, c[s - 1] = 1, order 2 s - 1, stage order s, L-stable (Hairer, Wanner, Solving Ordinary
 * Differential Equations II, 2nd ed., IV.5). They are computed in floating point, c and A to rounding. */
#pragma once

enum {
    KMP_COLLOCATION_STAGES = 7,
    KMP_COLLOCATION_LANES = 8,
    KMP_COLLOCATION_EIGENVALUES = 4,
    KMP_COLLOCATION_ENDS = 4,
    KMP_COLLOCATION_DECAYS = 4 /* Legendre coefficients that estimates of slow decay need */
};

/* Sums over the derivatives of the stages at the end of a step. */
enum {
    KMP_END_ONCE,       /* the integral over the step: the last row of A */
    KMP_END_TWICE,      /* the last row of A A */
    KMP_END_SLOPE,      /* filter times minus the stages' polynomial at 0 */
    KMP_END_SLOPE_TWICE /* the same of A times the derivatives, without the part of the initial value */
};

typedef struct kmp_collocation_table {
    int stages;
    double node[KMP_COLLOCATION_STAGES + 1];                                 /* 0, then c */
    double a[KMP_COLLOCATION_STAGES][KMP_COLLOCATION_STAGES];                /* A: y + h A f are the stages */
    double aa[KMP_COLLOCATION_STAGES][KMP_COLLOCATION_STAGES];               /* A A */
    double end[KMP_COLLOCATION_STAGES][KMP_COLLOCATION_ENDS];                /* of each stage */
    double barycentric[KMP_COLLOCATION_STAGES + 1];                          /* weights of the nodes */
    double legendre[KMP_COLLOCATION_STAGES + 1][KMP_COLLOCATION_STAGES + 1]; /* [i][j]: part of the i-th Legendre
                                                                              * polynomial of (0, 1) in the j-th
                                                                              * Lagrange polynomial of the nodes */
    double start[KMP_COLLOCATION_STAGES]; /* the polynomial through only the stages, at 0 */
    double lead[KMP_COLLOCATION_STAGES];  /* leading coefficient of its integral */
    double gap, centre;                   /* largest |x prod (x - c[i])| on (0, 1); mean of 0 and c */
    double filter;                        /* the real eigenvalue of A; even s has none: the geometric mean */

    /* Eigenvalues of A, of pairs the one with positive imaginary part. The first is `filter`, which is not an
     * eigenvalue for even s: its row and column below are zero. Row e of `into` takes stages to the complex coordinate
     * z[e] along eigenvector e; stage i is the sum of the real parts of outof[i][e] z[e]. */
    int eigenvalues; /* 0: not yet computed */
    double re[KMP_COLLOCATION_EIGENVALUES], im[KMP_COLLOCATION_EIGENVALUES];
    double into_re[KMP_COLLOCATION_EIGENVALUES][KMP_COLLOCATION_STAGES];
    double into_im[KMP_COLLOCATION_EIGENVALUES][KMP_COLLOCATION_STAGES];
    double outof_re[KMP_COLLOCATION_STAGES][KMP_COLLOCATION_EIGENVALUES];
    double outof_im[KMP_COLLOCATION_STAGES][KMP_COLLOCATION_EIGENVALUES];
} kmp_collocation_table;

/** Computes all members but the eigenvalues and their vectors for 2 to KMP_COLLOCATION_STAGES stages; then these. */
void kmp_collocation_make(kmp_collocation_table *table, int stages);
void kmp_collocation_add_eigenvalues(kmp_collocation_table *table);

/** All members for this number of stages; they are computed once in a process. */
const kmp_collocation_table *kmp_collocation_table_of(int stages);

/** Values at `places` x, KMP_COLLOCATION_LANES at most, of the polynomial of degree s through values at the nodes: the
 * weight of node j at place l is at j places + l. */
void kmp_collocation_weights(const kmp_collocation_table *table, int places, const double *x, double *weight);

/** Weights of its integral from 0 to x, and of the integral of that, KMP_COLLOCATION_STAGES + 1 each. */
void kmp_collocation_integrals(const kmp_collocation_table *table, double x, double *once, double *twice);
