/* SPDX-License-Identifier: BSD-3-Clause */
#include "ensemble/sampling/designs.h"
#include <string.h>

bool kmp_design_find(const char *word, kmp_design *design)
{
    static const char *const words[] = {[KMP_DESIGN_RANDOM] = "random",
                                        [KMP_DESIGN_LATIN] = "latin",
                                        [KMP_DESIGN_SOBOL] = "sobol",
                                        [KMP_DESIGN_SALTELLI] = "saltelli",
                                        [KMP_DESIGN_GRID] = "grid"};
    for (int k = 0; k <= KMP_DESIGN_GRID; k++)
        if (strcmp(word, words[k]) == 0) {
            *design = (kmp_design)k;
            return true;
        }
    return false;
}

/* -- random numbers by their place -------------------------------------------------------------------- */

/* Without a state: Philox 4x64 of 10 rounds (Salmon, Moraes, Dror, Shaw, Parallel random numbers: as easy as 1, 2, 3,
 * SC11, 2011). */
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

/* A whole number of 64 bits: that of place (i, j) of the stream of a seed. */
static uint64_t chance_bits(uint64_t seed, uint64_t stream, uint64_t i, uint64_t j)
{
    uint64_t numbers[4];
    philox((const uint64_t[]){seed, stream}, (const uint64_t[]){i, j, 0, 0}, numbers);
    return numbers[0];
}

/* A number in (0, 1), in the middle of one of 2^52 equal intervals. */
static double chance_at(uint64_t seed, uint64_t stream, uint64_t i, uint64_t j)
{
    return ((double)(chance_bits(seed, stream, i, j) >> 12) + 0.5) * 0x1p-52;
}

/* Streams of random numbers of one seed. */
enum { STREAM_POINTS, STREAM_ORDER };

/* -- Latin hypercube --------------------------------------------------------------------------------- */

/* A permutation of 0 .. count - 1, different for each column: a Feistel network of four rounds on the least even number
 * of bits that count - 1 fits into, applied until the result is below count (cycle walking; Black, Rogaway, Ciphers
 * with arbitrary finite domains, CT-RSA 2002). */
static uint64_t permuted(uint64_t seed, uint64_t k, uint64_t count, int column)
{
    int half = 1;
    while (half < 32 && (count - 1) >> (2 * half))
        half++;
    uint64_t mask = ((uint64_t)1 << half) - 1;
    do {
        uint64_t left = k >> half, right = k & mask;
        for (uint64_t round = 0; round < 4; round++) {
            uint64_t turned = chance_bits(seed, STREAM_ORDER, right, (uint64_t)column * 4 + round) & mask;
            uint64_t next = left ^ turned;
            left = right;
            right = next;
        }
        k = left << half | right;
    } while (k >= count);
    return k;
}

/* -- Sobol ------------------------------------------------------------------------------------------- */

typedef struct sobol_row {
    unsigned degree, coefficients;
    uint32_t first[18];
} sobol_row;

static const sobol_row sobol_rows[KMP_SOBOL_MOST] = {
    {0},
#define KMP_SOBOL(degree, coefficients, ...) {degree, coefficients, {__VA_ARGS__}},
#include "ensemble/sampling/sobol.def"
#undef KMP_SOBOL
};

/* Direction number i of a column, i from 0, by the recurrence of Bratley and Fox (ACM TOMS 14 (1988) 88). */
static uint32_t direction(const sobol_row *row, int i, uint32_t *v)
{
    int degree = (int)row->degree;
    if (degree == 0)
        return v[i] = (uint32_t)1 << (31 - i);
    if (i < degree)
        return v[i] = row->first[i] << (31 - i);
    uint32_t x = v[i - degree] ^ (v[i - degree] >> degree);
    for (int j = 1; j < degree; j++)
        if (row->coefficients >> (degree - 1 - j) & 1)
            x ^= v[i - j];
    return v[i] = x;
}

/* Point k is the sum of the direction numbers of the bits of its Gray code (Antonov, Saleev, 1979). */
static uint32_t sobol_point(uint64_t k, int column)
{
    uint32_t x = 0, v[32], gray = (uint32_t)(k ^ (k >> 1));
    for (int i = 0; i < 32 && gray >> i; i++) {
        uint32_t d = direction(&sobol_rows[column], i, v);
        x ^= gray >> i & 1 ? d : 0;
    }
    return x;
}

double kmp_design_point(kmp_design design, uint64_t seed, uint64_t k, uint64_t count, int column, int columns)
{
    if (design == KMP_DESIGN_SALTELLI) {
        /* The two points of a group have places of their own in the stream. */
        uint64_t size = (uint64_t)kmp_saltelli_group(columns), group = k / size;
        int member = (int)(k % size);
        bool second = member == 1 || member == 2 + column;
        return chance_at(seed, STREAM_POINTS, group, (uint64_t)(second ? columns + column : column));
    }
    double chance = design == KMP_DESIGN_SOBOL ? 0.5 : chance_at(seed, STREAM_POINTS, k, (uint64_t)column);
    if (design == KMP_DESIGN_LATIN)
        return ((double)permuted(seed, k, count, column) + chance) / (double)count;
    if (design == KMP_DESIGN_SOBOL)
        return (sobol_point(k, column) + 0.5) * 0x1p-32;
    return chance;
}
