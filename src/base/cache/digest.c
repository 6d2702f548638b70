/* SPDX-License-Identifier: BSD-3-Clause */
/* SHA-256 of FIPS 180-4, section 6.2. The checksum is a polynomial of four lanes of 64-bit words with odd factors. */
#include "base/cache/digest.h"
#include <string.h>

enum { BLOCK = 64, ROUNDS = 64 };

static const uint32_t first_state[8] = {0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                                        0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};

static const uint32_t constants[ROUNDS] = {
    0x428a2f98, 0x71374491, 0xb5c0fbcf, 0xe9b5dba5, 0x3956c25b, 0x59f111f1, 0x923f82a4, 0xab1c5ed5,
    0xd807aa98, 0x12835b01, 0x243185be, 0x550c7dc3, 0x72be5d74, 0x80deb1fe, 0x9bdc06a7, 0xc19bf174,
    0xe49b69c1, 0xefbe4786, 0x0fc19dc6, 0x240ca1cc, 0x2de92c6f, 0x4a7484aa, 0x5cb0a9dc, 0x76f988da,
    0x983e5152, 0xa831c66d, 0xb00327c8, 0xbf597fc7, 0xc6e00bf3, 0xd5a79147, 0x06ca6351, 0x14292967,
    0x27b70a85, 0x2e1b2138, 0x4d2c6dfc, 0x53380d13, 0x650a7354, 0x766a0abb, 0x81c2c92e, 0x92722c85,
    0xa2bfe8a1, 0xa81a664b, 0xc24b8b70, 0xc76c51a3, 0xd192e819, 0xd6990624, 0xf40e3585, 0x106aa070,
    0x19a4c116, 0x1e376c08, 0x2748774c, 0x34b0bcb5, 0x391c0cb3, 0x4ed8aa4a, 0x5b9cca4f, 0x682e6ff3,
    0x748f82ee, 0x78a5636f, 0x84c87814, 0x8cc70208, 0x90befffa, 0xa4506ceb, 0xbef9a3f7, 0xc67178f2};

static uint32_t turned(uint32_t x, int by)
{
    return x >> by | x << (32 - by);
}

static void add_block(kmp_digest *d, const unsigned char *block)
{
    uint32_t w[ROUNDS], s[8];
    /* The words of all rounds. */
    for (int i = 0; i < 16; i++)
        w[i] = (uint32_t)block[4 * i] << 24 | (uint32_t)block[4 * i + 1] << 16 | (uint32_t)block[4 * i + 2] << 8 |
               block[4 * i + 3];
    for (int i = 16; i < ROUNDS; i++) {
        uint32_t a = w[i - 15], b = w[i - 2];
        w[i] =
            w[i - 16] + (turned(a, 7) ^ turned(a, 18) ^ a >> 3) + w[i - 7] + (turned(b, 17) ^ turned(b, 19) ^ b >> 10);
    }
    memcpy(s, d->state, sizeof s);
    for (int i = 0; i < ROUNDS; i++) {
        uint32_t choice = (s[4] & s[5]) ^ (~s[4] & s[6]), majority = (s[0] & s[1]) ^ (s[0] & s[2]) ^ (s[1] & s[2]);
        uint32_t one = s[7] + (turned(s[4], 6) ^ turned(s[4], 11) ^ turned(s[4], 25)) + choice + constants[i] + w[i];
        uint32_t two = (turned(s[0], 2) ^ turned(s[0], 13) ^ turned(s[0], 22)) + majority;
        memmove(s + 1, s, 7 * sizeof *s);
        s[4] += one;
        s[0] = one + two;
    }
    for (int i = 0; i < 8; i++)
        d->state[i] += s[i];
}

void kmp_digest_begin(kmp_digest *d)
{
    *d = (kmp_digest){0};
    memcpy(d->state, first_state, sizeof d->state);
}

void kmp_digest_add(kmp_digest *d, const void *bytes, size_t size)
{
    const unsigned char *from = bytes;
    while (size > 0) {
        size_t at = d->length % BLOCK, part = BLOCK - at < size ? BLOCK - at : size;
        memcpy(d->block + at, from, part);
        d->length += part;
        from += part;
        size -= part;
        if (at + part == BLOCK)
            add_block(d, d->block);
    }
}

void kmp_digest_add_part(kmp_digest *d, const void *bytes, size_t size)
{
    uint64_t length = size;
    kmp_digest_add(d, &length, sizeof length);
    kmp_digest_add(d, bytes, size);
}

void kmp_digest_add_text(kmp_digest *d, const char *text)
{
    static const uint64_t none = UINT64_MAX;
    if (text)
        kmp_digest_add_part(d, text, strlen(text));
    else
        kmp_digest_add(d, &none, sizeof none);
}

void kmp_digest_end(kmp_digest *d, unsigned char out[KMP_DIGEST_SIZE])
{
    static const unsigned char end[BLOCK] = {0x80};
    uint64_t bits = 8 * d->length;
    unsigned char length[8];
    for (int i = 0; i < 8; i++)
        length[i] = (unsigned char)(bits >> (56 - 8 * i));
    kmp_digest_add(d, end, 1 + (119 - d->length % BLOCK) % BLOCK);
    kmp_digest_add(d, length, sizeof length);
    for (int i = 0; i < KMP_DIGEST_SIZE; i++)
        out[i] = (unsigned char)(d->state[i / 4] >> (24 - 8 * (i % 4)));
}

/* -- checksum ---------------------------------------------------------------------------------------- */

uint64_t kmp_checksum(const void *bytes, size_t size)
{
    enum { LANES = 4, STEP = LANES * sizeof(uint64_t) };
    static const uint64_t factor = 0x9e3779b97f4a7c15u;
    uint64_t lane[LANES] = {1, 2, 3, 4}, word[LANES], sum = size;
    const unsigned char *from = bytes;
    for (; size > 0; from += size < STEP ? size : STEP, size -= size < STEP ? size : STEP) {
        memset(word, 0, sizeof word);
        memcpy(word, from, size < STEP ? size : STEP);
        for (int i = 0; i < LANES; i++)
            lane[i] = (lane[i] ^ word[i] ^ (word[i] >> 29)) * factor;
    }
    for (int i = 0; i < LANES; i++) {
        /* Mixes a lane into the sum. */
        uint64_t x = sum ^ lane[i];
        x ^= x >> 32;
        x *= 0xd6e8feb86659fd93u;
        x ^= x >> 32;
        x *= 0xd6e8feb86659fd93u;
        sum = x ^ x >> 32;
    }
    return sum;
}
