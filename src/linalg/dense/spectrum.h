/* SPDX-License-Identifier: BSD-3-Clause */
/* Eigenvalues and eigenvectors of quadratic pencils
 *
 *     (s^2 M + s G + K) x = 0,     y^H (s^2 M + s G + K) = 0,     M symmetric and positive.
 *
 * Without G and with a symmetric K the symmetric solver finds them, exactly on the axes; otherwise a companion matrix
 * in coordinates and a time that scale themselves: those that M makes orthonormal, and the root of the norm of K
 * (Tisseur and Meerbergen 2001, section 3; Fan, Lin and Van Dooren 2004). Before either, zeros are separated: the null
 * space of K, then, stage by stage, what of the chains that begin in it is zero as well (Kublanovskaya 1966), so that
 * they are zeros and not roots of round-off. Allocates: not for hot paths. */
#ifndef KMP_LINALG_DENSE_SPECTRUM_H
#define KMP_LINALG_DENSE_SPECTRUM_H

#include <stdbool.h>

/** Of a pencil. Zeros come first, then by modulus; of a pair the one above the axis comes first. */
typedef struct kmp_spectrum {
    int p, count; /* size of the pencil, 2 p */
    int zeros;    /* how many are exactly zero */
    int still;    /* of these, how many have a vector of their own: the null space of K; the others repeat them */
    bool conservative;
    double *re, *im;     /* count */
    double *x_re, *x_im; /* p x count: x^H M x = 1 and the largest part real and positive; of zeros a basis of the
                            null space of K, the identity in `still` of its coordinates, whatever the libraries
                            below find */
    double *y_re, *y_im; /* p x count: y^H (2 s M + G) x = 1, or y' y = 1 where that cannot be; of zeros: zero */
} kmp_spectrum;

/** Of M, G and K (p x p, column-major). `companion`: never by the symmetric solver. 0; -1: no memory, or an iteration
 * did not converge; i + 1: minor i of M is not positive. */
int kmp_spectrum_init(kmp_spectrum *spectrum, int p, const double *mass, const double *damping, const double *stiffness,
                      bool companion);
void kmp_spectrum_free(kmp_spectrum *spectrum);

/** The same of a pencil whose M, `led`, is neither symmetric nor positive: `mass`, which is, stands for it in x^H M x
 * and in the choice of coordinates. With led = mass, but for rounding, it is the pencil above; otherwise it is never
 * taken for conservative. -2: led is singular. */
int kmp_spectrum_init_led(kmp_spectrum *spectrum, int p, const double *mass, const double *led, const double *damping,
                          const double *stiffness);

/** Where the conjugate of eigenvalue k stands; k itself when it is real. */
int kmp_spectrum_conjugate(const kmp_spectrum *spectrum, int k);

#endif
