/* SPDX-License-Identifier: BSD-3-Clause */
/* Mutations that keep more of a text's structure than single bytes do: a word takes the place of another, a line is
 * repeated elsewhere or taken out. Half of the time libFuzzer's own. */
#include "fuzz.h"

size_t LLVMFuzzerMutate(uint8_t *data, size_t size, size_t most);
size_t LLVMFuzzerCustomMutator(uint8_t *data, size_t size, size_t most, unsigned seed);

typedef struct piece {
    size_t at, length;
} piece;

static unsigned next(unsigned *seed)
{
    *seed = *seed * 1664525u + 1013904223u;
    return *seed >> 8;
}

static bool is_word(uint8_t c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '.';
}

/* The word at or after a place chosen by chance; empty at the end. */
static piece some_word(const uint8_t *data, size_t size, unsigned *seed)
{
    size_t at = next(seed) % size, end;
    while (at > 0 && is_word(data[at]) && is_word(data[at - 1]))
        at--;
    while (at < size && !is_word(data[at]))
        at++;
    for (end = at; end < size && is_word(data[end]);)
        end++;
    return (piece){at, end - at};
}

static piece some_line(const uint8_t *data, size_t size, unsigned *seed)
{
    size_t at = next(seed) % size, end = at;
    while (at > 0 && data[at - 1] != '\n')
        at--;
    while (end < size && data[end] != '\n')
        end++;
    return (piece){at, end + (end < size) - at};
}

/* `what` instead of `place`; the old size when there is no room. */
static size_t put(uint8_t *data, size_t size, size_t most, piece place, const uint8_t *what, size_t length)
{
    size_t after = place.at + place.length;
    if (size - place.length + length > most)
        return size;
    memmove(data + place.at + length, data + after, size - after);
    if (length > 0)
        memcpy(data + place.at, what, length);
    return size - place.length + length;
}

static size_t exchange(uint8_t *data, size_t size, size_t most, unsigned *seed)
{
    uint8_t copy[256];
    bool lines = next(seed) & 1;
    piece from = (lines ? some_line : some_word)(data, size, seed),
          to = (lines ? some_line : some_word)(data, size, seed);
    if (from.length > sizeof copy)
        return size;
    memcpy(copy, data + from.at, from.length);
    if (lines && next(seed) & 1)
        to.length = 0; /* stays, behind */
    return put(data, size, most, to, copy, from.length);
}

size_t LLVMFuzzerCustomMutator(uint8_t *data, size_t size, size_t most, unsigned seed)
{
    unsigned kind = next(&seed) % 8;
    size_t made = size;
    if (kind < 4 && size > 0)
        made =
            kind < 3 ? exchange(data, size, most, &seed) : put(data, size, most, some_line(data, size, &seed), NULL, 0);
    return kind < 4 && made > 0 && size > 0 ? made : LLVMFuzzerMutate(data, size, most);
}
