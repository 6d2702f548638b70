/* SPDX-License-Identifier: BSD-3-Clause */
/* Modes at one state: eigenvalues s of s^2 Mr + s Gr + Kr, their vectors extended to all coordinates by N = dq/du, and
 * the participation of each coordinate. A model with sampled states has the modes of its map from sample to sample, a
 * model with delays the modes of the rightmost roots of its characteristic equation. */
#pragma once

#include "analyses/derivatives/linearized.h"
#include "analyses/derivatives/parameter_slopes.h"
#include "analyses/derivatives/spectrum.h"
#include "analyses/derivatives/state_sensitivity.h"
#include "base/arena.h"
#include "model/data/force.h"

typedef struct kmp_modes {
    const kempe_system *system;
    kmp_arena arena;       /* of all arrays */
    int n, p, count;       /* coordinates, independent ones, eigenvalues: 2 p, or the known ones with delays */
    int shown;             /* the eigenvalues that count; others help to follow them over a parameter */
    bool endless;          /* with delays: there are more, without end */
    double bound;          /* with delays: none that is absent has a larger real part; NAN: not known */
    int moving, *u;        /* the independent coordinates that are not constant states */
    kmp_spectrum spectrum; /* of sampled motion s = ln(z)/T, and of delays: without vectors */
    double period;         /* T, in which all samples repeat; 0: no state is sampled */
    double *z_re, *z_im;   /* count: eigenvalues from one common sample to the next; NULL: no state is sampled */
    double *re, *im; /* n x count: shapes, in the charts of the state; the largest entry in parts of the size of its
                        coordinate is 1 and real */
    double *shown_re, *shown_im; /* n x count: in the user's coordinates; the same arrays where no joint is spherical */
    double *kinetic;   /* n x count: share of each coordinate in the kinetic energy; of a mode they add up to 1 */
    double *potential; /* n x count: of the elastic energy; zero where there is none */
} kmp_modes;

/** At the state of `linear`, whose matrices are made. With sampled states, which the system has as an averaged one
 * (analyses/derivatives/averaged.h), shapes are those before the samples. `brief`: with delays, without a bound.
 * KEMPE_E_FAILED: the reduced mass is not positive, or no iteration converges. */
kempe_status kmp_modes_init(kmp_modes *modes, kmp_linear *linear, bool brief);
void kmp_modes_free(kmp_modes *modes);

/** True for a motion that is over within a sample: its s represents all that are as fast or faster. */
bool kmp_modes_is_over(const kmp_modes *modes, int c);

/** The largest modulus of all that are not over within a sample. */
double kmp_modes_size(const kmp_modes *modes);

/** The modal assurance criterion of shape a of one and shape b of another: 1 for equal shapes up to a factor, 0 for
 * orthogonal ones. Both must be of the same system. */
double kmp_modes_likeness(const kmp_modes *first, int a, const kmp_modes *second, int b);

/** The threshold of growth: a larger real part, which exceeds rounding. */
double kmp_modes_noise(const kmp_modes *modes);

/* Derivatives of eigenvalues by parameters. A mode is a small motion dq, dqd, dqdd, dlambda of the whole system with du
 * = x, dud = s x, dudd = s^2 x that leaves R = 0, so that with P = s^2 Mr + s Gr + Kr
 *
 *     ds = - y^H dP x / (y^H (2 s Mr + Gr) x),     y^H P = 0.
 *
 * dP x is the residual of R when the mode is constant and the equations change. It consists of their second derivatives
 * along the mode and along the parameter's change of the state (analyses/derivatives/parameter_slopes.h).
 * kmp_linear_follow corrects the closures of the mode. No derivative of N is needed: the mode has its own multipliers.
 * Equal eigenvalues have the derivatives of the small matrix -(Y^H (2 s Mr + Gr) X)^-1 Y^H dP X (Lancaster 1964;
 * Mills-Curran 1988). */

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
