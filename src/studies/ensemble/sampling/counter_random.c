/* SPDX-License-Identifier: BSD-3-Clause */
#include "studies/ensemble/sampling/counter_random.h"

enum { ROUNDS = 10 };

/* The upper half of a product; *low: the lower one. */
static uint64_t product(uint64_t a, uint64_t b, uint64_t *low)
{
    __extension__ typedef unsigned __int128 wide;
    wide p = (wide)a * b;
    *low = (uint64_t)p;
    return (uint64_t)(p >> 64);
}

/* The four numbers of a counter under a key. */
static void philox(const uint64_t key[2], const uint64_t counter[4], uint64_t x[4])
{
    uint64_t k0 = key[0], k1 = key[1];
    for (int i = 0; i < 4; i++)
        x[i] = counter[i];
    for (int round = 0; round < ROUNDS; round++) {
        uint64_t low0, low2, high0 = product(0xD2E7470EE14C6C93u, x[0], &low0),
                             high2 = product(0xCA5A826395121157u, x[2], &low2);
        x[0] = high2 ^ x[1] ^ k0;
        x[1] = low2;
        x[2] = high0 ^ x[3] ^ k1;
        x[3] = low0;
        k0 += 0x9E3779B97F4A7C15u;
        k1 += 0xBB67AE8584CAA73Bu;
    }
}

uint64_t kmp_chance_bits(uint64_t seed, uint64_t stream, uint64_t i, uint64_t j)
{
    uint64_t numbers[4];
    philox((const uint64_t[]){seed, stream}, (const uint64_t[]){i, j, 0, 0}, numbers);
    return numbers[0];
}

double kmp_chance(uint64_t seed, uint64_t stream, uint64_t i, uint64_t j)
{
    return ((double)(kmp_chance_bits(seed, stream, i, j) >> 12) + 0.5) * 0x1p-52;
}
