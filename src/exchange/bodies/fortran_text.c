/* SPDX-License-Identifier: BSD-3-Clause */
#include "exchange/bodies/fortran_text.h"
#include "base/text.h"
#include <math.h>
#include <string.h>

bool kmp_text_line_next(kmp_text_line *line)
{
    if (!*line->rest)
        return false;
    line->s = line->rest;
    line->length = strcspn(line->s, "\n");
    line->rest = line->s + line->length + (line->s[line->length] == '\n');
    line->length -= line->length > 0 && line->s[line->length - 1] == '\r';
    line->number++;
    line->column = 1;
    return true;
}

static bool is_blank(char c)
{
    return c == ' ' || c == '\t' || c == '\r';
}

void kmp_text_line_trim(kmp_text_line *line)
{
    while (line->length > 0 && is_blank(line->s[line->length - 1]))
        line->length--;
    while (line->length > 0 && is_blank(*line->s)) {
        line->s++;
        line->length--;
        line->column++;
    }
}

bool kmp_fortran_number(const char *s, size_t length, double *value)
{
    char plain[84];
    size_t count = 0;
    kmp_text_line own = {.s = s, .length = length};
    kmp_text_line_trim(&own);
    const bool negative = own.length > 0 && *own.s == '-';
    const size_t sign = own.length > 0 && (*own.s == '-' || *own.s == '+');
    if (own.length == sign || own.length > sizeof plain / 2 - 2)
        return false;
    for (size_t k = sign; k < own.length; k++) {
        const char c = own.s[k], before = k > sign ? own.s[k - 1] : 0;
        const bool power = (c == '+' || c == '-') && (before == '.' || (before >= '0' && before <= '9'));
        if (power) /* 1.0+2 */
            plain[count++] = 'e';
        plain[count++] = c == 'D' || c == 'd' || c == 'E' ? 'e' : c;
    }
    plain[count] = '\0';
    if (kmp_text_to_number(plain, value) != count || !isfinite(*value))
        return false;
    *value = negative ? -*value : *value;
    return true;
}

bool kmp_fortran_whole(const char *s, size_t length, int *value)
{
    kmp_text_line own = {.s = s, .length = length};
    kmp_text_line_trim(&own);
    const size_t sign = own.length > 0 && (*own.s == '-' || *own.s == '+');
    int sum = 0;
    if (own.length == sign || own.length > 9 + sign)
        return false;
    for (size_t k = sign; k < own.length; k++) {
        if (own.s[k] < '0' || own.s[k] > '9')
            return false;
        sum = 10 * sum + (own.s[k] - '0');
    }
    *value = sign && *own.s == '-' ? -sum : sum;
    return true;
}
