/* SPDX-License-Identifier: BSD-3-Clause */
#include "output/json.h"

kmp_json kmp_json_begin(kmp_text *text)
{
    return (kmp_json){.text = text};
}

static void indent(kmp_json *json)
{
    kmp_text_put(json->text, "\n");
    for (int k = 0; k < json->depth; k++)
        kmp_text_put(json->text, "  ");
}

/* Writes the text before a value: comma, line, key. */
static void lead(kmp_json *json, const char *key)
{
    if (json->filled)
        kmp_text_put(json->text, ",");
    if (json->depth > 0)
        indent(json);
    if (key) {
        kmp_text_quote(json->text, key);
        kmp_text_put(json->text, ": ");
    }
    json->filled = true;
}

static void begin_level(kmp_json *json, const char *key, const char *bracket, char close)
{
    lead(json, key);
    kmp_text_put(json->text, bracket);
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
    if (json->depth < KMP_JSON_DEPTH)
        kmp_text_printf(json->text, "%c", json->close[json->depth]);
    if (json->depth == 0)
        kmp_text_put(json->text, "\n");
    json->filled = true;
}

void kmp_json_number(kmp_json *json, const char *key, double x)
{
    lead(json, key);
    kmp_text_number(json->text, x);
}

void kmp_json_whole(kmp_json *json, const char *key, long x)
{
    lead(json, key);
    kmp_text_printf(json->text, "%ld", x);
}

void kmp_json_string(kmp_json *json, const char *key, const char *s)
{
    lead(json, key);
    if (s)
        kmp_text_quote(json->text, s);
    else
        kmp_text_put(json->text, "null");
}

void kmp_json_true(kmp_json *json, const char *key)
{
    lead(json, key);
    kmp_text_put(json->text, "true");
}

void kmp_json_boolean(kmp_json *json, const char *key, bool x)
{
    lead(json, key);
    kmp_text_put(json->text, x ? "true" : "false");
}

void kmp_json_numbers(kmp_json *json, const char *key, int count, const double *x)
{
    lead(json, key);
    kmp_text_put(json->text, "[");
    for (int k = 0; k < count; k++) {
        kmp_text_put(json->text, k > 0 ? ", " : "");
        kmp_text_number(json->text, x[k]);
    }
    kmp_text_put(json->text, "]");
}
