/* SPDX-License-Identifier: BSD-3-Clause */
/* Irregularities with a spectrum: each narrow band becomes one harmonic, with a random phase. */
#pragma once

#include "model/data/wheels.h"

/** Density of alignment, level or cross level at an angular frequency over the length, rad/m, in m^2/(rad/m). The
 * variance is its integral over the frequencies from the longest wavelength to the shortest one. 0 for other
 * irregularities. */
double kmp_wave_spectrum_density(int kind, kmp_irregularity what, double frequency);

/** The number of knots of a generated irregularity. */
double kmp_wave_spectrum_knots(const kmp_wave_spectrum *spectrum);

/** Generates one irregularity from a spectrum, zero at its ends and beyond; it is determined by the seed. NULL: no
 * memory. */
struct kmp_table *kmp_wave_spectrum_make(const kmp_wave_spectrum *spectrum, kmp_irregularity what);
