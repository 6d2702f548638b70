/* SPDX-License-Identifier: BSD-3-Clause */
/* Derivatives of eigenvalues by parameters. A mode is a small motion dq, dqd, dqdd, dlambda of the whole system with du
 * = x, dud = s x, dudd = s^2 x that leaves R = 0, so that with P = s^2 Mr + s Gr + Kr
 *
 *     ds = - y^H dP x / (y^H (2 s Mr + Gr) x),     y^H P = 0.
 *
 * dP x is the residual of R when the mode is constant and the equations change. It consists of their second derivatives
 * along the mode and along the parameter's change of the state (analyses/derivatives/second_derivatives.h).
 * kmp_linear_follow corrects the closures of the mode. No derivative of N is needed: the mode has its own multipliers.
 * Equal eigenvalues have the derivatives of the small matrix -(Y^H (2 s Mr + Gr) X)^-1 Y^H dP X (Lancaster 1964;
 * Mills-Curran 1988). */
#pragma once

#include "analyses/derivatives/second_derivatives.h"
#include "analyses/derivatives/spectrum.h"
#include "analyses/derivatives/state_sensitivity.h"

/** Availability of an eigenvalue's derivatives. */
typedef enum kmp_mode_kind {
    KMP_MODE_SIMPLE,
    KMP_MODE_REPEATED,  /* equal to others, with as many vectors: a derivative each, in the order of their size */
    KMP_MODE_DEFECTIVE, /* equal to others, with fewer vectors: there is no derivative */
    KMP_MODE_ZERO       /* exactly zero: none is sought */
} kmp_mode_kind;

typedef struct kmp_mode_slopes {
    kmp_arena arena;  /* of all arrays */
    int modes, count; /* eigenvalues of the spectrum, parameters */
    kmp_mode_kind *kind;
    double *re, *im; /* of eigenvalue i by parameter k at i count + k; NaN where there is none */
} kmp_mode_slopes;

/** Derivatives for the spectrum of `linear` at its state, whose matrices are made; `shift` has the sensitivity of the
 * state. KEMPE_E_MEMORY.
 */
kempe_status kmp_mode_slopes_init(kmp_mode_slopes *slopes, kmp_linear *linear, kmp_second_derivatives *second,
                                  const kmp_state_sensitivity *shift, const kmp_spectrum *spectrum);
void kmp_mode_slopes_free(kmp_mode_slopes *slopes);
