/* SPDX-License-Identifier: BSD-3-Clause */
/* Stability of small motions about an equilibrium: the eigenvalues of Mr s^2 + Gr s + Kr, zeros separated. The result
 * is of first order and for the given model: a constant rate holds only if the model enforces it. */
#pragma once

#include "derivatives/linearized.h"

typedef enum kmp_stability_word {
    KMP_STABLE,  /* all small motions decay */
    KMP_NEUTRAL, /* nothing grows; some motions remain displaced, or continue */
    KMP_UNSTABLE,
    KMP_NOT_HELD, /* friction sticks there by more than it can have: the state is no equilibrium */
    KMP_UNDECIDED /* the reduced mass is not positive, or singular by forces of multipliers; a root of delays is almost
                     on the axis */
} kmp_stability_word;

typedef struct kmp_stability {
    kmp_stability_word word;
    int growing;   /* eigenvalues with a positive real part */
    bool secular;  /* motions grow as a power of time (linalg/dense/spectrum.h) */
    double re, im; /* the eigenvalue whose real part is largest, zeros left out; NaN: there is none */
    int still;     /* directions in which R does not change */
    int *along;    /* the coordinates that move most in each */
} kmp_stability;

/** At the last state, its matrices made. `along`: room for p. KEMPE_E_MEMORY. */
kempe_status kmp_stability_judge(const kmp_linear *linear, kmp_stability *stability);

/** "stable", "neutral", "unstable", "not held", "undecided". */
const char *kmp_stability_text(kmp_stability_word word);
