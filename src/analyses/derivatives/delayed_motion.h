/* SPDX-License-Identifier: BSD-3-Clause */
/* Small motions of models with delays, from the linear equations of the averaged system (averaged.h), whose equation of
 * a delay by T is m y' + g y - u/T = 0. The exact one of a motion by e^(s t) has m (e^(s T) - 1)/T in place of m s. */
#pragma once

#include "analyses/derivatives/linearized.h"
#include <complex.h>

/** The delay of unknown k; 0: it is none. */
double kmp_delay_of(const kmp_linear *linear, int k);

/** The characteristic equation P(s) x = 0 of the unknowns that move: coordinates and values of states. The row of a
 * delay is multiplied by e^(-s T). */
typedef struct kmp_delayed_equation {
    const kmp_linear *linear;
    kmp_arena arena;         /* of all arrays */
    int count;               /* of unknowns */
    int *place;              /* count: each among u */
    int order;               /* of the determinant in s */
    double longest;          /* the sum of the delays */
    double _Complex *matrix; /* count x count: work */
    int *pivot;
} kmp_delayed_equation;

/** With the linear equations at a state. KEMPE_E_MEMORY. */
kempe_status kmp_delayed_equation_init(kmp_delayed_equation *equation, const kmp_linear *linear);
void kmp_delayed_equation_free(kmp_delayed_equation *equation);

/** An entry of P(s), its derivative by s, and the sum of the moduli of its terms. */
typedef struct kmp_delayed_entry {
    double complex value, slope;
    double size;
} kmp_delayed_entry;

kmp_delayed_entry kmp_delayed_entry_at(const kmp_delayed_equation *equation, double complex s, int row, int column);

/** The number of roots with a real part above `bound`, which is not that of a root, by the principle of the argument:
 * the argument of the determinant over s = bound + i w from w = 0 to infinity turns by half a turn less for each of
 * them. KEMPE_E_FAILED without a message: a root is too close to that line. */
kempe_status kmp_delayed_right_of(const kmp_delayed_equation *equation, double bound, int *count);

/** Finds how many roots have a positive real part, and how many are zero. With the linear equations at a state.
 * KEMPE_E_MEMORY; KEMPE_E_FAILED without a message: a root is too close to the axis. */
kempe_status kmp_delayed_growing(const kmp_linear *linear, int *growing, int *zeros);
