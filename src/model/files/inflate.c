/* SPDX-License-Identifier: BSD-3-Clause */
/* Codes are read bit by bit by counts of each length, the canonical order of RFC 1951, 3.2.2: files of models are
 * small, and need no tables. */
#include "model/files/inflate.h"
#include <string.h>

enum { LONGEST = 15, LITERALS = 288, DISTANCES = 30, LENGTHS = 29, LENGTH_CODES = 19, BLOCK_END = 256 };

/* The bytes on both sides. `bad`: they end early, or mean nothing. */
typedef struct stream {
    const unsigned char *from;
    size_t length, next;
    unsigned held; /* bits that are read and not used, the first one lowest */
    int held_count;
    unsigned char *to;
    size_t size, done;
    bool bad;
} stream;

/* The number of codes of each length, and their symbols in the order of codes. */
typedef struct code {
    int count[LONGEST + 1];
    int symbol[LITERALS];
} code;

static unsigned bits(stream *s, int count)
{
    while (s->held_count < count) {
        if (s->next == s->length) {
            s->bad = true;
            return 0;
        }
        s->held |= (unsigned)s->from[s->next++] << s->held_count;
        s->held_count += 8;
    }
    const unsigned value = s->held & ((1u << count) - 1);
    s->held >>= count;
    s->held_count -= count;
    return value;
}

/* A code from the lengths of its symbols, 0: not used. False: more symbols than such codes have, or fewer, where it is
 * not a single one. */
static bool make(code *c, const unsigned char *lengths, int symbols)
{
    int first[LONGEST + 2] = {0}, left = 1, used = 0;
    memset(c->count, 0, sizeof c->count);
    for (int k = 0; k < symbols; k++)
        c->count[lengths[k]]++;
    used = symbols - c->count[0];
    c->count[0] = 0;
    for (int k = 1; k <= LONGEST; k++) {
        left = 2 * left - c->count[k];
        if (left < 0)
            return false;
        first[k + 1] = first[k] + c->count[k];
    }
    for (int k = 0; k < symbols; k++)
        if (lengths[k] > 0)
            c->symbol[first[lengths[k]]++] = k;
    return left == 0 || used <= 1;
}

static int symbol(stream *s, const code *c)
{
    int value = 0, first = 0, index = 0;
    for (int k = 1; k <= LONGEST && !s->bad; k++) {
        value |= (int)bits(s, 1);
        if (value - first < c->count[k])
            return c->symbol[index + value - first];
        index += c->count[k];
        first = (first + c->count[k]) << 1;
        value <<= 1;
    }
    s->bad = true;
    return 0;
}

static void copy_stored(stream *s)
{
    s->held = 0;
    s->held_count = 0;
    const unsigned char *head = s->from + s->next;
    if (s->length - s->next < 4 || head[0] + head[2] != 0xff || head[1] + head[3] != 0xff) {
        s->bad = true;
        return;
    }
    const size_t count = head[0] + 256u * head[1];
    s->next += 4;
    if (s->length - s->next < count || s->size - s->done < count) {
        s->bad = true;
        return;
    }
    memcpy(s->to + s->done, s->from + s->next, count);
    s->next += count;
    s->done += count;
}

/* Symbols up to the end of the block (3.2.5). */
static void expand(stream *s, const code *literals, const code *distances)
{
    static const short base[LENGTHS] = {3,  4,  5,  6,  7,  8,  9,  10, 11,  13,  15,  17,  19,  23, 27,
                                        31, 35, 43, 51, 59, 67, 83, 99, 115, 131, 163, 195, 227, 258};
    static const char more[LENGTHS] = {0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2,
                                       2, 3, 3, 3, 3, 4, 4, 4, 4, 5, 5, 5, 5, 0};
    static const short away[DISTANCES] = {1,    2,    3,    4,    5,    7,    9,    13,    17,    25,
                                          33,   49,   65,   97,   129,  193,  257,  385,   513,   769,
                                          1025, 1537, 2049, 3073, 4097, 6145, 8193, 12289, 16385, 24577};
    static const char further[DISTANCES] = {0, 0, 0, 0, 1, 1, 2, 2,  3,  3,  4,  4,  5,  5,  6,
                                            6, 7, 7, 8, 8, 9, 9, 10, 10, 11, 11, 12, 12, 13, 13};
    for (int k = symbol(s, literals); k != BLOCK_END && !s->bad; k = symbol(s, literals)) {
        if (k < BLOCK_END) {
            s->bad = s->bad || s->done == s->size;
            if (!s->bad)
                s->to[s->done++] = (unsigned char)k;
            continue;
        }
        if (k - BLOCK_END - 1 >= LENGTHS) {
            s->bad = true;
            return;
        }
        const size_t count = (size_t)base[k - BLOCK_END - 1] + bits(s, more[k - BLOCK_END - 1]);
        const int d = symbol(s, distances);
        if (s->bad || d >= DISTANCES) {
            s->bad = true;
            return;
        }
        const size_t back = (size_t)away[d] + bits(s, further[d]);
        if (back > s->done || s->size - s->done < count) {
            s->bad = true;
            return;
        }
        for (size_t i = 0; i < count; i++, s->done++)
            s->to[s->done] = s->to[s->done - back];
    }
}

static void expand_fixed(stream *s)
{
    unsigned char lengths[LITERALS], ways[DISTANCES];
    code literals, distances;
    for (int k = 0; k < LITERALS; k++)
        lengths[k] = k < 144 ? 8 : k < 256 ? 9 : k < 280 ? 7 : 8;
    memset(ways, 5, sizeof ways);
    (void)make(&literals, lengths, LITERALS);
    (void)make(&distances, ways, DISTANCES);
    expand(s, &literals, &distances);
}

/* The lengths of both codes, themselves in a code (3.2.7). */
static void expand_dynamic(stream *s)
{
    static const unsigned char order[LENGTH_CODES] = {16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15};
    unsigned char lengths[LITERALS + DISTANCES + 4] = {0};
    code first, literals, distances;
    const int n = 257 + (int)bits(s, 5), m = 1 + (int)bits(s, 5), given = 4 + (int)bits(s, 4);
    for (int k = 0; k < given; k++)
        lengths[order[k]] = (unsigned char)bits(s, 3);
    if (s->bad || n > 286 || m > DISTANCES || !make(&first, lengths, LENGTH_CODES)) {
        s->bad = true;
        return;
    }
    memset(lengths, 0, sizeof lengths);
    for (int k = 0; k < n + m && !s->bad;) {
        const int own = symbol(s, &first);
        if (own < 16) {
            lengths[k++] = (unsigned char)own;
            continue;
        }
        int count = own == 16 ? 3 + (int)bits(s, 2) : own == 17 ? 3 + (int)bits(s, 3) : 11 + (int)bits(s, 7);
        if ((own == 16 && k == 0) || k + count > n + m) {
            s->bad = true;
            return;
        }
        for (const unsigned char last = own == 16 ? lengths[k - 1] : 0; count > 0; count--)
            lengths[k++] = last;
    }
    if (s->bad || lengths[BLOCK_END] == 0 || !make(&literals, lengths, n) || !make(&distances, lengths + n, m))
        s->bad = true;
    else
        expand(s, &literals, &distances);
}

bool kmp_inflate(const unsigned char *from, size_t length, unsigned char *to, size_t size)
{
    stream s = {.from = from, .length = length, .to = to, .size = size};
    for (bool last = false; !last && !s.bad;) {
        last = bits(&s, 1);
        const unsigned kind = bits(&s, 2);
        if (s.bad || kind == 3)
            return false;
        if (kind == 0)
            copy_stored(&s);
        else if (kind == 1)
            expand_fixed(&s);
        else
            expand_dynamic(&s);
    }
    return !s.bad && s.done == size;
}
