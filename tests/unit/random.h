/* SPDX-License-Identifier: BSD-3-Clause */
/* Numbers that look random and are the same on every machine: Knuth's MMIX generator. */
#ifndef KEMPE_TESTS_RANDOM_H
#define KEMPE_TESTS_RANDOM_H

#include <stdint.h>

static uint64_t random_state = 1;

static inline void random_seed(uint64_t seed)
{
    random_state = seed * 2862933555777941757u + 3037000493u;
}

/* Uniform in [low, high). */
static inline double between(double low, double high)
{
    random_state = random_state * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * (double)(random_state >> 11) * 0x1p-53;
}

/* One of 0 .. n - 1. */
static inline int pick(int n)
{
    return (int)between(0, n);
}

#endif
