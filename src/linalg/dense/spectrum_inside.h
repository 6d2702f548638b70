/* SPDX-License-Identifier: BSD-3-Clause */
/* The working data of a pencil, shared by spectrum.c and spectrum_zeros.c. */
#ifndef KMP_LINALG_DENSE_SPECTRUM_INSIDE_H
#define KMP_LINALG_DENSE_SPECTRUM_INSIDE_H

#include "linalg/dense/spectrum.h"
#include <float.h>
#include <math.h>
#include <stddef.h>

typedef struct kmp_pencil {
    kmp_arena arena;
    int p, n; /* n = 2 p */
    const double *mass, *damping, *stiffness;
    const double *led; /* the coefficient of s^2 where it is not the mass; NULL: the mass */
    double *apart;     /* LU of `led` in coordinates in which the mass is 1 */
    int *pivot;
    double *l;      /* Cholesky factor of the mass */
    double *g, *k;  /* G and K where M is 1 */
    double rate;    /* of the time in which K has norm 1 */
    double *t, *h;  /* n x n: orthogonal, and t' A t */
    double *a, *s;  /* n x n, n: scratch */
    double *vector; /* n x n: of an iteration */
    double *part[6];
    double *row;   /* n */
    double *noise; /* n: the magnitude that rounding in a row of h is relative to */
} kmp_pencil;

static inline size_t kmp_bytes(int count)
{
    return (size_t)count * sizeof(double);
}

static inline double kmp_norm_of(int count, const double *a)
{
    double sum = 0, largest = 0;
    for (int i = 0; i < count; i++)
        largest = fmax(largest, fabs(a[i]));
    for (int i = 0; largest > 0 && i < count; i++)
        sum += a[i] / largest * (a[i] / largest);
    return largest * sqrt(sum);
}

/* The largest value that counts as rounding, for matrices of size n and norm 1. */
static inline double kmp_rounding(int n)
{
    return 64 * n * DBL_EPSILON;
}

/** Deflates zeros of the companion matrix A of w->g, w->k and w->rate: t is orthogonal and h = t' A t has the zeros
 * first. These are the null space of K, then zeros of the chains that begin in it. Returns the number of zeros, and
 * sets s->still; -1: no memory or no convergence. */
int kmp_pencil_deflate(kmp_pencil *w, kmp_spectrum *s);

/** Eigenvectors of zeros as columns of `basis` (p x still): the identity in as many coordinates, those that move most.
 * The basis is one of many with x' M x = 1. Its rows, each times the root of its mass, have singular values of at least
 * 1/sqrt(p), so that no chosen row is small. 0; -1: no memory. */
int kmp_pencil_put_still(kmp_pencil *w, kmp_spectrum *s, double *basis);

#endif
