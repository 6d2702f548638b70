/* SPDX-License-Identifier: BSD-3-Clause */
#include "language_server/text_places.h"
#include <string.h>

static bool ends_line(char c)
{
    return c == '\n' || c == '\r';
}

/* Bytes of the character at `s`, which is not the end. */
static size_t character_length(const char *s)
{
    size_t length = 1;
    while (((unsigned char)s[length] & 0xC0) == 0x80)
        length++;
    return length;
}

/* The beginning of line `line`, from 0 on, or of the last one. */
static const char *line_at(const char *text, long line)
{
    const char *begin = text;
    for (const char *s = text; *s && line > 0;) {
        const bool ends = ends_line(*s);
        s += s[0] == '\r' && s[1] == '\n' ? 2 : 1;
        if (ends) {
            begin = s;
            line--;
        }
    }
    return line > 0 ? text + strlen(text) : begin;
}

size_t kmp_offset_of(const char *text, kmp_position position, bool wide)
{
    const char *s = line_at(text, position.line);
    for (long unit = 0; *s && !ends_line(*s) && unit < position.unit;) {
        const size_t length = character_length(s);
        const long units = !wide ? (long)length : length == 4 ? 2 : 1;
        if (unit + units > position.unit)
            break;
        unit += units;
        s += length;
    }
    return (size_t)(s - text);
}

kmp_position kmp_position_of(const char *text, size_t offset, bool wide)
{
    kmp_position position = {0, 0};
    for (size_t k = 0; k < offset && text[k];) {
        const size_t length = character_length(text + k);
        if (text[k] == '\r' && text[k + 1] == '\n') {
            position.unit++;
        } else if (ends_line(text[k])) {
            position.line++;
            position.unit = 0;
        } else {
            position.unit += !wide ? (long)length : length == 4 ? 2 : 1;
        }
        k += length;
    }
    return position;
}

size_t kmp_offset_of_place(const char *text, kmp_place place)
{
    const char *s = line_at(text, place.line - 1);
    for (int column = 1; column < place.column && *s && !ends_line(*s); column++)
        s += character_length(s);
    return (size_t)(s - text);
}

size_t kmp_line_begin(const char *text, size_t offset)
{
    while (offset > 0 && !ends_line(text[offset - 1]))
        offset--;
    return offset;
}
