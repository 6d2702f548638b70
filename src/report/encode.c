/* SPDX-License-Identifier: BSD-3-Clause */
#include "report/encode.h"

void kmp_encode_numbers(kmp_text *text, int count, const double *x, int digits)
{
    kmp_text_put(text, "[");
    for (int k = 0; k < count; k++) {
        kmp_text_put(text, k > 0 ? "," : "");
        kmp_text_rounded(text, x[k], digits);
    }
    kmp_text_put(text, "]");
}

/* RFC 4648. */
static void put_three(kmp_text *text, const unsigned char byte[3], int count)
{
    static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    unsigned bits = (unsigned)byte[0] << 16 | (unsigned)byte[1] << 8 | byte[2];
    char out[5] = {0};
    for (int k = 0; k < 4; k++)
        out[k] = '=';
    for (int k = 0; k <= count; k++)
        out[k] = letters[bits >> (18 - 6 * k) & 63];
    kmp_text_put(text, out);
}

void kmp_encode_short(kmp_text *text, size_t count, const int16_t *x)
{
    unsigned char byte[3] = {0};
    int filled = 0;
    kmp_text_put(text, "\"");
    for (size_t k = 0; k < 2 * count; k++) {
        unsigned value = (uint16_t)x[k / 2];
        byte[filled++] = (unsigned char)(k % 2 ? value >> 8 : value & 255);
        if (filled < 3)
            continue;
        put_three(text, byte, 3);
        filled = 0;
    }
    for (int k = filled; k < 3; k++)
        byte[k] = 0;
    if (filled > 0)
        put_three(text, byte, filled);
    kmp_text_put(text, "\"");
}

void kmp_encode_string(kmp_text *text, const char *s)
{
    kmp_text quoted = {0};
    kmp_text_quote(&quoted, s);
    for (const char *c = quoted.s; c && *c; c++) {
        char one[2] = {*c, 0};
        kmp_text_put(text, *c == '<' ? "\\u003c" : one);
    }
    text->failed = text->failed || quoted.failed;
    kmp_text_free(&quoted);
}
