/* SPDX-License-Identifier: BSD-3-Clause */
/* The rightmost roots of the characteristic equation of a model with delays, which has roots without end.
 *
 * Between its input and its output the signal of a delay moves at unit speed: w(t, theta) = u(t + theta),
 * -T <= theta <= 0. Its values at Chebyshev points, together with the states, are a linear system (pseudospectral
 * discretisation of the infinitesimal generator: Breda, Maset and Vermiglio 2005), whose eigenvalues nearest to the
 * origin are roots up to a small error. Newton's method on P(s) x = 0 ends it, and the residual of each root is
 * checked. The principle of the argument then counts the roots to the right of a line, none of which may be absent. */
#pragma once

#include "analyses/derivatives/linearized.h"
#include "model/data/force.h"
#include <complex.h>

/** The delay of unknown k; 0: it is none. */
double kmp_delay_of(const kmp_linear *linear, int k);

/** Finds how many roots have a positive real part, and how many are zero. With the linear equations at a state.
 * KEMPE_E_MEMORY; KEMPE_E_FAILED without a message: a root is too close to the axis. */
kempe_status kmp_delayed_growing(const kmp_linear *linear, int *growing, int *zeros);

typedef struct kmp_delayed_spectrum {
    kmp_arena arena;  /* of all arrays */
    int p, count;     /* unknowns of the linear equations; roots that were found */
    int zeros, still; /* the first ones are exactly zero; `still` of them have vectors, the others repeat them */
    int shown;        /* the first roots, zeros and then by modulus: all to the right of `bound`; the others follow */
    double bound;     /* NAN: it is not known that no root is absent */
    double *re, *im;  /* count: of a pair the upper one first */
    double *x_re, *x_im; /* p x count: changes of coordinates, values of states; of zeros the identity in
                          * `still` of them */
} kmp_delayed_spectrum;

/** Computes it at the state of `linear`, whose matrices are made; `zeros`: the number of zero roots of the
 * averaged system. `brief`: without a bound, all roots that were found are shown. KEMPE_E_MEMORY; KEMPE_E_FAILED with a
 * sentence: Mr is singular, or an iteration does not converge. To be freed in any case. */
kempe_status kmp_delayed_spectrum_init(kmp_delayed_spectrum *spectrum, const kmp_linear *linear, int zeros, bool brief);
void kmp_delayed_spectrum_free(kmp_delayed_spectrum *spectrum);
