/* SPDX-License-Identifier: BSD-3-Clause */
/* Small motions of models with delays, from the linear equations of the averaged system (averaged.h), whose equation of
 * a delay by T is m y' + g y - u/T = 0. The exact one of a motion by e^(s t) has m (e^(s T) - 1)/T in place of m s. */
#pragma once

#include "derivatives/linearized.h"

/** The delay of unknown k; 0: it is none. */
double kmp_delay_of(const kmp_linear *linear, int k);

/** Finds how many roots of the characteristic equation have a positive real part, and how many are zero, by the
 * principle of the argument: the determinant over s = i w from 0 to infinity, whose argument turns by half a turn less
 * for each root on the right. With the linear equations at a state. KEMPE_E_MEMORY; KEMPE_E_FAILED without a message:
 * a root is too close to the axis. */
kempe_status kmp_delayed_growing(const kmp_linear *linear, int *growing, int *zeros);
