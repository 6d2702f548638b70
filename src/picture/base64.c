/* SPDX-License-Identifier: BSD-3-Clause */
#include "picture/base64.h"
#include <string.h>

/* Bytes that are written in threes. */
typedef struct bytes {
    kmp_text *text;
    unsigned char byte[3];
    int filled;
} bytes;

/* RFC 4648. */
static void put_three(bytes *b)
{
    static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    unsigned bits = (unsigned)b->byte[0] << 16 | (unsigned)b->byte[1] << 8 | b->byte[2];
    char out[5] = "====";
    for (int k = 0; k <= b->filled; k++)
        out[k] = letters[bits >> (18 - 6 * k) & 63];
    kmp_text_put(b->text, out);
    memset(b->byte, 0, sizeof b->byte);
    b->filled = 0;
}

static void put_bytes(bytes *b, uint32_t value, int count)
{
    for (int k = 0; k < count; k++) {
        b->byte[b->filled++] = (unsigned char)(value >> (8 * k) & 255);
        if (b->filled == 3)
            put_three(b);
    }
}

/* Ends the bytes as a member. */
static void end_bytes(bytes *b, kmp_json *json, const char *key)
{
    if (b->filled > 0)
        put_three(b);
    kmp_json_text(json, key, b->text);
}

void kmp_json_shorts(kmp_json *json, const char *key, size_t count, const int16_t *x)
{
    kmp_text text = {0};
    bytes b = {.text = &text};
    for (size_t k = 0; k < count; k++)
        put_bytes(&b, (uint16_t)x[k], 2);
    end_bytes(&b, json, key);
}

void kmp_json_floats(kmp_json *json, const char *key, size_t count, const double *x)
{
    kmp_text text = {0};
    bytes b = {.text = &text};
    for (size_t k = 0; k < count; k++) {
        float rounded = (float)x[k];
        uint32_t bits;
        memcpy(&bits, &rounded, sizeof bits);
        put_bytes(&b, bits, 4);
    }
    end_bytes(&b, json, key);
}
