/* SPDX-License-Identifier: BSD-3-Clause */
/* Coefficients of Radau IIA of s stages, which is collocation at the zeros c of a Radau polynomial, c[s - 1] = 1: order
 * 2 s - 1, stage order s, L-stable (Hairer, Wanner, Solving Ordinary Differential Equations II, 2nd ed., IV.5). */
#ifndef KMP_INTEGRATORS_STEPPERS_RADAU_METHOD_H
#define KMP_INTEGRATORS_STEPPERS_RADAU_METHOD_H

enum { KMP_RADAU_MAX_STAGES = 5, KMP_RADAU_MAX_PAIRS = KMP_RADAU_MAX_STAGES / 2 };

/** The stages z[i] = Y[i] - y and the polynomial p with p(0) = 0, p(c[i]) = z[i] fulfil
 *
 *     p'(c[i]) = sum d[i][j] z[j] = h f(Y[i])          d = T diag(g, block(a1, b1), ..) T^-1
 *
 * where block(a, b) = (a b; -b a) stands for the eigenvalues a +- i b. */
typedef struct kmp_radau_method {
    int stages, pairs;
    double c[KMP_RADAU_MAX_STAGES];
    double d[KMP_RADAU_MAX_STAGES][KMP_RADAU_MAX_STAGES];
    double butcher[KMP_RADAU_MAX_STAGES][KMP_RADAU_MAX_STAGES]; /* d^-1; its last row are the weights */
    double g;                                                   /* the real eigenvalue of d */
    double a[KMP_RADAU_MAX_PAIRS], b[KMP_RADAU_MAX_PAIRS];      /* the complex ones */
    double t[KMP_RADAU_MAX_STAGES][KMP_RADAU_MAX_STAGES]; /* T: the real eigenvector, then real and imaginary parts */
    double inverse[KMP_RADAU_MAX_STAGES][KMP_RADAU_MAX_STAGES]; /* T^-1 */
    double slope[KMP_RADAU_MAX_STAGES];                         /* p'(0) = sum slope[j] z[j] */
    double node_weight[KMP_RADAU_MAX_STAGES + 1];               /* barycentric, of 0 and then of c */
    double gap;    /* largest |x prod (x - c[i])| on (0, 1): a polynomial of degree s + 1 minus p, over its leading
                    * coefficient */
    double centre; /* mean of 0 and c */
    double factor[KMP_RADAU_MAX_STAGES + 2]; /* powers of x of the integral of prod (x - c[i]) / prod (-c[i]) from 0 */
} kmp_radau_method;

extern const kmp_radau_method kmp_radau_3, kmp_radau_5; /* of 3 and 5 stages */

/** weight[0 .. stages): p(x) = sum weight[j] z[j]. */
void kmp_radau_weights(const kmp_radau_method *method, double x, double *weight);

/** The integral of prod (x - c[i]) from 0, divided by that product at 0: the correction of p for a unit error of its
 * slope at 0. It is 0 at both ends of the step. */
double kmp_radau_weight(const kmp_radau_method *method, double x);

#endif
