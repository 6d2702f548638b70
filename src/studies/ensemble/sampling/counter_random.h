/* SPDX-License-Identifier: BSD-3-Clause */
/* Random numbers by their place, without a state: Philox 4x64 of 10 rounds (Salmon, Moraes, Dror, Shaw, Parallel random
 * numbers: as easy as 1, 2, 3, SC11, 2011). */
#pragma once

#include <stdint.h>

/** A number in (0, 1), in the middle of one of 2^52 equal intervals: that of place (i, j) of the stream of a seed. */
double kmp_chance(uint64_t seed, uint64_t stream, uint64_t i, uint64_t j);

/** The same place as a whole number of 64 bits. */
uint64_t kmp_chance_bits(uint64_t seed, uint64_t stream, uint64_t i, uint64_t j);
