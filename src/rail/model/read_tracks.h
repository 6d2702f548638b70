/* SPDX-License-Identifier: BSD-3-Clause */
#pragma once

#include "model/data/wheels.h"
#include "model/read/reading.h"

/** Density of alignment, level or cross level at an angular frequency over the length, rad/m, in m^2/(rad/m). The
 * variance is its integral over the frequencies from the longest wavelength to the shortest one. 0 for other
 * irregularities. */
double kmp_wave_spectrum_density(int kind, kmp_irregularity what, double frequency);

void kmp_read_tracks(kmp_reader *r);
