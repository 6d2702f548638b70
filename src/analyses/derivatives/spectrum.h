/* SPDX-License-Identifier: BSD-3-Clause */
/* Eigenvalues and eigenvectors of quadratic pencils
 *
 *     (s^2 M + s G + K) x = 0,     y^H (s^2 M + s G + K) = 0,     M symmetric and positive.
 *
 * Without G and with a symmetric K the symmetric solver finds them, exactly on the axes. Otherwise they come from a
 * companion matrix that is scaled: coordinates that M makes orthonormal, time by the root of the norm of K (Tisseur and
 * Meerbergen 2001, section 3; Fan, Lin and Van Dooren 2004). Before either, zeros are separated: the null space of K,
 * then, stage by stage, zeros of the chains that begin in it (Kublanovskaya 1966). So they are exact zeros, not roots
 * of round-off. Coordinates that no entry connects are solved apart, at scales of the whole. Allocates: not for hot
 * paths. */
#pragma once

#include "base/arena.h"

/** Distance of eigenvalues that count as one, over the largest modulus: the root of rounding, by which rounding splits
 * zeros that have one eigenvector. */
#define KMP_SPECTRUM_EQUAL 1e-5

/** Eigenvalues and eigenvectors of a pencil. Zeros come first, then by modulus; of a pair the eigenvalue above the real
 * axis comes first. */
typedef struct kmp_spectrum {
    int p, count; /* size of the pencil, 2 p */
    int zeros;    /* number of eigenvalues that are exactly zero */
    int still;    /* number of zeros with separate eigenvectors: the null space of K; the other zeros repeat them */
    bool conservative;
    bool secular;        /* motions grow as a power of time: an eigenvalue on the axis has fewer eigenvectors than its
                            multiplicity, or a zero a longer chain than a free motion, which has displacement and rate */
    int secular_at;      /* that eigenvalue */
    double *re, *im;     /* count */
    double *x_re, *x_im; /* p x count: x^H M x = 1, the largest part real and positive; zeros: a basis of the null space
                            of K, the identity in `still` of its coordinates, independent of the LAPACK build */
    double *y_re, *y_im; /* p x count: y^H (2 s M + G) x = 1, or y' y = 1 where that cannot be; of zeros: zero */
    kmp_arena arena;
} kmp_spectrum;

/** Solves the pencil of M, G and K (p x p, column-major). `led` (NULL: the mass) replaces M where it is neither
 * symmetric nor positive; the mass, which is both, is then the mass of x^H M x and of the choice of coordinates, and
 * the result is never taken for conservative unless led = mass up to rounding. `companion`: never by the symmetric
 * solver. 0; -1: no memory, or an iteration did not converge; -2: led is singular; i + 1: minor i of the mass is not
 * positive.
 */
int kmp_spectrum_init(kmp_spectrum *spectrum, int p, const double *mass, const double *led, const double *damping,
                      const double *stiffness, bool companion);
void kmp_spectrum_free(kmp_spectrum *spectrum);

/** The index of the conjugate of eigenvalue k; k itself when it is real. */
int kmp_spectrum_conjugate(const kmp_spectrum *spectrum, int k);
