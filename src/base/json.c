/* SPDX-License-Identifier: BSD-3-Clause */
/* The writer of JSON: levels, keys and commas, numbers with the fewest digits that read back, templates of members. */
#include "base/json.h"
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

kmp_json kmp_json_begin_as(kmp_text *text, kmp_json_layout layout)
{
    return (kmp_json){.text = text, .layout = layout};
}

kmp_json kmp_json_begin(kmp_text *text)
{
    return kmp_json_begin_as(text, KMP_JSON_LINES);
}

void kmp_json_line(kmp_json *json, const char *line)
{
    json->line = line;
}

static void indent(kmp_json *json)
{
    if (json->layout != KMP_JSON_LINES)
        return;
    kmp_text_put(json->text, "\n");
    for (int k = 0; k < json->depth; k++)
        kmp_text_put(json->text, "  ");
}

/* A string; within a script `<` might end it. */
static void quote(kmp_json *json, const char *s)
{
    kmp_text quoted = {0};
    if (json->layout == KMP_JSON_WORDS)
        kmp_text_put(json->text, s);
    else if (json->layout != KMP_JSON_COMPACT)
        kmp_text_quote(json->text, s);
    if (json->layout != KMP_JSON_COMPACT)
        return;
    kmp_text_quote(&quoted, s);
    for (const char *c = quoted.s; c && *c;) {
        const size_t plain = strcspn(c, "<");
        kmp_text_append(json->text, c, plain);
        c += plain;
        if (*c && c++)
            kmp_text_put(json->text, "\\u003c");
    }
    kmp_text_free_part(json->text, &quoted);
}

/* The comma, the line and the key before a value. */
static void put_key(kmp_json *json, const char *key)
{
    static const char *const after[] = {": ", ":", ": ", " "};
    bool on_line = json->layout == KMP_JSON_DENSE || json->layout == KMP_JSON_WORDS;
    if (json->filled)
        kmp_text_put(json->text, ",");
    if (json->depth > 0)
        indent(json);
    if (on_line)
        kmp_text_put(json->text, json->line ? json->line : json->filled ? " " : "");
    if (key) {
        quote(json, key);
        kmp_text_put(json->text, after[json->layout]);
    }
    json->line = NULL;
    json->filled = true;
}

static void begin_level(kmp_json *json, const char *key, const char *bracket, char close)
{
    put_key(json, key);
    kmp_text_put(json->text, json->layout == KMP_JSON_WORDS ? "" : bracket);
    if (json->depth < KMP_JSON_DEPTH)
        json->close[json->depth] = close;
    else
        json->text->failed = true;
    json->depth++;
    json->filled = false;
}

void kmp_json_object(kmp_json *json, const char *key)
{
    begin_level(json, key, "{", '}');
}

void kmp_json_array(kmp_json *json, const char *key)
{
    begin_level(json, key, "[", ']');
}

void kmp_json_end(kmp_json *json)
{
    json->depth--;
    if (json->filled)
        indent(json);
    if (json->depth < KMP_JSON_DEPTH && json->layout != KMP_JSON_WORDS)
        kmp_text_printf(json->text, "%c", json->close[json->depth]);
    if (json->depth == 0 && (json->layout == KMP_JSON_LINES || json->layout == KMP_JSON_DENSE))
        kmp_text_put(json->text, "\n");
    json->filled = true;
}

/* With the digits of the writer for 0. */
static void put_number(kmp_json *json, double x, int digits)
{
    digits = digits > 0 ? digits : json->digits;
    if (digits > 0)
        kmp_text_rounded(json->text, x, digits);
    else
        kmp_text_number(json->text, x);
}

void kmp_json_rounded(kmp_json *json, const char *key, double x, int digits)
{
    put_key(json, key);
    put_number(json, x, digits);
}

void kmp_json_number(kmp_json *json, const char *key, double x)
{
    kmp_json_rounded(json, key, x, 0);
}

void kmp_json_whole(kmp_json *json, const char *key, long x)
{
    put_key(json, key);
    kmp_text_printf(json->text, "%ld", x);
}

void kmp_json_string(kmp_json *json, const char *key, const char *s)
{
    put_key(json, key);
    if (s)
        quote(json, s);
    else
        kmp_text_put(json->text, "null");
}

void kmp_json_text(kmp_json *json, const char *key, kmp_text *s)
{
    kmp_json_string(json, key, s->s ? s->s : "");
    kmp_text_free_part(json->text, s);
}

void kmp_json_boolean(kmp_json *json, const char *key, bool x)
{
    put_key(json, key);
    kmp_text_put(json->text, x ? "true" : "false");
}

/* -- members by a template ---------------------------------------------------------------------------- */

static void put_value(kmp_json *json, const char *key, const char *conversion, va_list *arguments)
{
    switch (conversion[strcspn(conversion, "gdsi")]) {
    case 'g':
        kmp_json_rounded(json, key, va_arg(*arguments, double), conversion[1] == '.' ? atoi(conversion + 2) : 0);
        break;
    case 'd':
        kmp_json_whole(json, key, conversion[1] == 'l' ? va_arg(*arguments, long) : va_arg(*arguments, int));
        break;
    case 's':
        kmp_json_string(json, key, va_arg(*arguments, const char *));
        break;
    default:
        kmp_json_boolean(json, key, va_arg(*arguments, int));
    }
}

/* The next word of a template, of which `at` is behind it afterwards; false: there is none. */
static bool next_word(const char **at, char *word, size_t room)
{
    size_t length = strcspn(*at, " ");
    if (length == 0 || length >= room)
        return false;
    memcpy(word, *at, length);
    word[length] = '\0';
    *at += length + strspn(*at + length, " ");
    return true;
}

void kmp_json_put(kmp_json *json, const char *format, ...)
{
    char word[64], room[64];
    const char *key = NULL;
    va_list arguments;
    va_start(arguments, format);
    while (next_word(&format, word, sizeof word)) {
        const char *of = key;
        bool in_object = json->depth > 0 && json->depth <= KMP_JSON_DEPTH && json->close[json->depth - 1] == '}';
        key = NULL;
        if (*word == '}' || *word == ']')
            kmp_json_end(json);
        else if (*word == '{')
            kmp_json_object(json, of);
        else if (*word == '[')
            kmp_json_array(json, of);
        else if (*word != '%')
            key = strcpy(room, word);
        else if (!of && in_object)
            key = va_arg(arguments, const char *);
        else
            put_value(json, of, word, &arguments);
    }
    va_end(arguments);
}

void kmp_json_rounded_numbers(kmp_json *json, const char *key, int count, const double *x, int digits)
{
    put_key(json, key);
    kmp_text_put(json->text, "[");
    for (int k = 0; k < count; k++) {
        kmp_text_put(json->text, k == 0 ? "" : json->layout == KMP_JSON_COMPACT ? "," : ", ");
        put_number(json, x[k], digits);
    }
    kmp_text_put(json->text, "]");
}

void kmp_json_numbers(kmp_json *json, const char *key, int count, const double *x)
{
    kmp_json_rounded_numbers(json, key, count, x, 0);
}
