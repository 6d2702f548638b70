/* SPDX-License-Identifier: BSD-3-Clause */
#include "language_server/json_value.h"
#include "base/text.h"
#include <stdlib.h>
#include <string.h>

typedef struct json_reader {
    kmp_arena *arena;
    const char *at, *end;
    int level;
    bool replaced; /* a character of the last string */
} json_reader;

static const kmp_json_value *read_value(json_reader *r);

static void skip_blanks(json_reader *r)
{
    while (r->at < r->end && (*r->at == ' ' || *r->at == '\t' || *r->at == '\n' || *r->at == '\r'))
        r->at++;
}

static bool take(json_reader *r, char c)
{
    skip_blanks(r);
    if (r->at == r->end || *r->at != c)
        return false;
    r->at++;
    return true;
}

/* -- strings ------------------------------------------------------------------------------------------ */

/* The four digits of \uXXXX; -1: there are others. */
static long read_hex(json_reader *r)
{
    long code = 0;
    for (int k = 0; k < 4; k++, r->at++) {
        const char *digits = "0123456789abcdef0123456789ABCDEF",
                   *found = r->at < r->end && *r->at ? strchr(digits, *r->at) : NULL;
        if (!found)
            return -1;
        code = 16 * code + (found - digits) % 16;
    }
    return code;
}

/* A character of two halves, or the mark of an unknown one; no text has a zero. */
static long join_halves(json_reader *r, long code)
{
    enum { UNKNOWN = 0xFFFD };
    if (code > 0 && (code < 0xD800 || code > 0xDFFF))
        return code;
    if (code >= 0xD800 && code <= 0xDBFF && r->end - r->at >= 6 && r->at[0] == '\\' && r->at[1] == 'u') {
        const char *before = r->at;
        r->at += 2;
        const long low = read_hex(r);
        if (low >= 0xDC00 && low <= 0xDFFF)
            return 0x10000 + ((code - 0xD800) << 10) + (low - 0xDC00);
        r->at = before;
    }
    r->replaced = true;
    return UNKNOWN;
}

static char *put_character(char *to, long code)
{
    if (code < 0x80) {
        *to++ = (char)code;
        return to;
    }
    const int more = code < 0x800 ? 1 : code < 0x10000 ? 2 : 3;
    static const int first[] = {0, 0xC0, 0xE0, 0xF0};
    *to++ = (char)(first[more] | (int)(code >> (6 * more)));
    for (int k = more - 1; k >= 0; k--)
        *to++ = (char)(0x80 | ((code >> (6 * k)) & 0x3F));
    return to;
}

/* One character behind a backslash; NULL: it is none of JSON. */
static char *read_escape(json_reader *r, char *to)
{
    static const char letters[] = "\"\\/bfnrt", meant[] = "\"\\/\b\f\n\r\t";
    const char c = r->at < r->end ? *r->at++ : '\0';
    const char *found = c ? strchr(letters, c) : NULL;
    if (found) {
        *to++ = meant[found - letters];
        return to;
    }
    const long code = c == 'u' ? read_hex(r) : -1;
    return code < 0 ? NULL : put_character(to, join_halves(r, code));
}

/* Behind its first quote; NULL: an error. No escape is shorter than what it means. */
static const char *read_string(json_reader *r)
{
    const char *end = r->at;
    while (end < r->end && *end != '"')
        end += *end == '\\' && end + 1 < r->end ? 2 : 1;
    char *text = kmp_arena_alloc(r->arena, (size_t)(end - r->at) + 1, 1), *to = text;
    r->replaced = false;
    while (to && r->at < r->end && *r->at != '"') {
        const char c = *r->at++;
        if (c == '\\')
            to = read_escape(r, to);
        else
            *to++ = (char)(c ? c : '?');
    }
    if (!to || r->at == r->end)
        return NULL;
    r->at++;
    *to = '\0';
    return text;
}

/* -- values ------------------------------------------------------------------------------------------- */

/* Adds an item, of an object with its key. False: no memory. */
static bool add_item(json_reader *r, kmp_json_value *to, const char *key, const kmp_json_value *item)
{
    const char **keys = key ? kmp_arena_room(r->arena, to->keys, to->count, sizeof *keys) : NULL;
    const kmp_json_value **items = kmp_arena_room(r->arena, to->items, to->count, sizeof *items);
    if (!items || (key && !keys))
        return false;
    if (key)
        keys[to->count] = key;
    items[to->count++] = item;
    to->keys = keys;
    to->items = items;
    return true;
}

static bool read_items(json_reader *r, kmp_json_value *to)
{
    const bool object = to->kind == KMP_JSON_OBJECT;
    const char close = object ? '}' : ']';
    if (++r->level > KMP_JSON_LEVELS)
        return false;
    bool good = true, ends = take(r, close);
    while (good && !ends) {
        const char *key = NULL;
        if (object) {
            key = take(r, '"') ? read_string(r) : NULL;
            good = key && take(r, ':');
        }
        const kmp_json_value *item = good ? read_value(r) : NULL;
        good = item && add_item(r, to, key, item);
        ends = good && take(r, close);
        good = good && (ends || take(r, ','));
    }
    r->level--;
    return good;
}

/* A number, true, false or null. */
static bool read_plain(json_reader *r, kmp_json_value *to)
{
    size_t length = 0;
    while (r->at + length < r->end && r->at[length] &&
           strchr("+-.0123456789abcdefghijklmnopqrstuvwxyzE", r->at[length]))
        length++;
    char *text = kmp_arena_alloc(r->arena, length + 1, 1), *end = text;
    if (!text || length == 0)
        return false;
    memcpy(text, r->at, length);
    r->at += length;
    to->text = text;
    if (strcmp(text, "null") == 0) {
        to->text = "";
        return true;
    }
    if (strcmp(text, "true") == 0 || strcmp(text, "false") == 0) {
        to->kind = KMP_JSON_BOOLEAN;
        return true;
    }
    double value;
    to->kind = KMP_JSON_NUMBER;
    end += *text == '-';
    return kmp_text_to_number(end, &value) == strlen(end);
}

static const kmp_json_value *read_value(json_reader *r)
{
    kmp_json_value *value = KMP_ARENA_NEW(r->arena, kmp_json_value, 1);
    if (!value)
        return NULL;
    value->text = "";
    if (take(r, '"')) {
        value->kind = KMP_JSON_STRING;
        value->text = read_string(r);
        value->replaced = r->replaced;
        return value->text ? value : NULL;
    }
    if (take(r, '{')) {
        value->kind = KMP_JSON_OBJECT;
        return read_items(r, value) ? value : NULL;
    }
    if (take(r, '[')) {
        value->kind = KMP_JSON_ARRAY;
        return read_items(r, value) ? value : NULL;
    }
    return read_plain(r, value) ? value : NULL;
}

/* True if the bytes are characters of UTF-8, without halves of pairs and none longer than needed. */
static bool is_utf8(const char *text, size_t length)
{
    static const unsigned least[] = {0, 0x80, 0x800, 0x10000};
    for (size_t k = 0; k < length;) {
        const unsigned char c = (unsigned char)text[k++];
        const int more = c < 0x80 ? 0 : c >> 5 == 6 ? 1 : c >> 4 == 14 ? 2 : c >> 3 == 30 ? 3 : -1;
        unsigned code = more < 1 ? c : c & (0x3FU >> more);
        for (int i = 0; i < more; i++, k++) {
            if (k == length || ((unsigned char)text[k] & 0xC0) != 0x80)
                return false;
            code = code << 6 | ((unsigned char)text[k] & 0x3F);
        }
        if (more < 0 || code < least[more] || code > 0x10FFFF || (code >= 0xD800 && code <= 0xDFFF))
            return false;
    }
    return true;
}

const kmp_json_value *kmp_json_read(kmp_arena *arena, const char *text, size_t length)
{
    if (!is_utf8(text, length))
        return NULL;
    json_reader r = {.arena = arena, .at = text, .end = text + length};
    const kmp_json_value *value = read_value(&r);
    skip_blanks(&r);
    return r.at == r.end ? value : NULL;
}

const kmp_json_value *kmp_json_member(const kmp_json_value *object, const char *key)
{
    for (int k = 0; object && object->kind == KMP_JSON_OBJECT && k < object->count; k++)
        if (strcmp(object->keys[k], key) == 0)
            return object->items[k];
    return NULL;
}

const char *kmp_json_word(const kmp_json_value *object, const char *key)
{
    const kmp_json_value *value = kmp_json_member(object, key);
    return value && value->kind == KMP_JSON_STRING ? value->text : NULL;
}

long kmp_json_count(const kmp_json_value *object, const char *key)
{
    const kmp_json_value *value = kmp_json_member(object, key);
    const double x = value && value->kind == KMP_JSON_NUMBER ? strtod(value->text, NULL) : -1;
    return x >= 0 && x < 2e9 ? (long)x : -1;
}
