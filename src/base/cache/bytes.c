/* SPDX-License-Identifier: BSD-3-Clause */
/* Writing and reading of bytes with a sticky failure: sizes are bounded before anything is allocated, so that a damaged
 * file costs no memory. */
#include "base/cache/bytes.h"
#include "base/memory.h"
#include <limits.h>
#include <string.h>

enum { FIRST_ROOM = 4096, NO_TEXT = -1 };

void kmp_bytes_free(kmp_bytes *b)
{
    kmp_free(b->at);
    *b = (kmp_bytes){0};
}

void kmp_bytes_put(kmp_bytes *b, const void *from, size_t size)
{
    size_t room = b->room ? b->room : FIRST_ROOM;
    while (room - b->size < size && room <= SIZE_MAX / 4)
        room *= 2;
    unsigned char *at = b->failed || room - b->size < size ? NULL : b->at;
    if (room > b->room && !b->failed)
        at = kmp_realloc(b->at, room, 1);
    if (!at) {
        b->failed = true;
        return;
    }
    b->at = at;
    b->room = room;
    if (size > 0)
        memcpy(at + b->size, from, size);
    b->size += size;
}

void kmp_bytes_put_int(kmp_bytes *b, int64_t value)
{
    kmp_bytes_put(b, &value, sizeof value);
}

void kmp_bytes_put_text(kmp_bytes *b, const char *text)
{
    size_t length = text ? strlen(text) : 0;
    kmp_bytes_put_int(b, text ? (int64_t)length : NO_TEXT);
    kmp_bytes_put(b, text, length);
}

kmp_byte_source kmp_byte_source_of(const void *bytes, size_t size)
{
    static const unsigned char none[1];
    const unsigned char *at = bytes ? bytes : none;
    return (kmp_byte_source){at, at + size, false};
}

void kmp_bytes_take(kmp_byte_source *s, void *to, size_t size)
{
    s->failed = s->failed || (size_t)(s->end - s->at) < size;
    if (s->failed) {
        if (size > 0)
            memset(to, 0, size);
        return;
    }
    if (size > 0)
        memcpy(to, s->at, size);
    s->at += size;
}

int kmp_bytes_take_int(kmp_byte_source *s, int low, int high)
{
    int64_t value;
    kmp_bytes_take(s, &value, sizeof value);
    s->failed = s->failed || value < low || value > high;
    return s->failed ? low : (int)value;
}

int kmp_bytes_take_count(kmp_byte_source *s, size_t size)
{
    int count = kmp_bytes_take_int(s, 0, INT_MAX);
    size_t left = s->failed ? 0 : (size_t)(s->end - s->at);
    s->failed = s->failed || (size > 0 && (size_t)count > left / size);
    return s->failed ? 0 : count;
}

char *kmp_bytes_take_text(kmp_byte_source *s, kmp_arena *arena)
{
    int length = kmp_bytes_take_int(s, NO_TEXT, INT_MAX - 1);
    if (s->failed || length == NO_TEXT || s->end - s->at < length) {
        s->failed = s->failed || length != NO_TEXT;
        return NULL;
    }
    char *text = KMP_ARENA_NEW(arena, char, (size_t)length + 1);
    if (text)
        kmp_bytes_take(s, text, (size_t)length);
    s->failed = s->failed || !text;
    return text;
}
