/* SPDX-License-Identifier: BSD-3-Clause */
/* Errors and nodes: functions for every part of the reader. */
#include "model/read/reading.h"
#include <stdarg.h>
#include <string.h>

/* -- errors -------------------------------------------------------------------------------------- */

static void say(kmp_reader *r, kmp_place place, kmp_text *sentence)
{
    r->wrong = true;
    if (sentence->failed || kmp_complain(r->context, r->model->files[place.file], place.line, place.column, "%s",
                                         sentence->s) == KEMPE_E_MEMORY)
        r->scratch.failed = true;
    kmp_text_free(sentence);
}

void kmp_reader_complain(kmp_reader *r, kmp_place place, const char *format, ...)
{
    kmp_text sentence = {0};
    va_list arguments;
    va_start(arguments, format);
    kmp_text_vprintf(&sentence, format, arguments);
    va_end(arguments);
    say(r, place, &sentence);
}

void kmp_reader_complain_near(kmp_reader *r, kmp_place place, const kmp_nearest *nearest, const char *format, ...)
{
    kmp_text sentence = {0};
    va_list arguments;
    va_start(arguments, format);
    kmp_text_vprintf(&sentence, format, arguments);
    va_end(arguments);
    kmp_nearest_suggest(nearest, &sentence);
    say(r, place, &sentence);
}

const char *kmp_reader_say(kmp_reader *r, const char *format, ...)
{
    kmp_text text = {0};
    va_list arguments;
    va_start(arguments, format);
    kmp_text_vprintf(&text, format, arguments);
    va_end(arguments);
    const char *kept = text.failed ? NULL : kmp_arena_strdup(&r->scratch, text.s);
    if (text.failed)
        r->scratch.failed = true;
    kmp_text_free(&text);
    return kept ? kept : "";
}

static const char *kind_name(const kmp_yaml *node)
{
    if (node->empty)
        return "nothing";
    return node->kind == KMP_YAML_LIST ? "a list" : node->kind == KMP_YAML_MAP ? "a mapping" : "a word";
}

static void complain_key(kmp_reader *r, const kmp_yaml *key, const char *what, const char *const *keys)
{
    kmp_text sentence = {0};
    kmp_nearest nearest = kmp_nearest_begin(key->text);
    for (int i = 0; keys[i]; i++)
        kmp_nearest_offer(&nearest, keys[i]);
    kmp_text_printf(&sentence, "unknown key '%s' in %s", key->text, what);
    if (nearest.best)
        kmp_nearest_suggest(&nearest, &sentence);
    else
        for (int i = 0; keys[i]; i++)
            kmp_text_printf(&sentence, "%s%s", i == 0 ? "; its keys are " : ", ", keys[i]);
    say(r, key->place, &sentence);
}

static bool is_one_of(const char *word, const char *const *words)
{
    for (int i = 0; words[i]; i++)
        if (strcmp(words[i], word) == 0)
            return true;
    return false;
}

/* -- nodes --------------------------------------------------------------------------------------- */

bool kmp_read_map(kmp_reader *r, const kmp_yaml *node, const char *what, const char *const *keys)
{
    if (node->empty)
        return true;
    if (node->kind != KMP_YAML_MAP) {
        kmp_reader_complain(r, node->place, "%s must be a mapping (key: value), not %s", what, kind_name(node));
        return false;
    }
    for (int i = 0; keys && i < node->count; i++)
        if (!is_one_of(node->keys[i]->text, keys))
            complain_key(r, node->keys[i], what, keys);
    return true;
}

bool kmp_read_list(kmp_reader *r, const kmp_yaml *node, const char *what, int count)
{
    if (node->kind != KMP_YAML_LIST)
        kmp_reader_complain(r, node->place, "%s must be a list [..], not %s", what, kind_name(node));
    else if (count >= 0 && node->count != count)
        kmp_reader_complain(r, node->place, "%s must be a list of %d items, not %d", what, count, node->count);
    else
        return true;
    return false;
}

const char *kmp_read_word(kmp_reader *r, const kmp_yaml *node, const char *what)
{
    if (node->kind == KMP_YAML_SCALAR && node->text[0])
        return node->text;
    kmp_reader_complain(r, node->place, "%s must be a word, not %s", what,
                        node->kind == KMP_YAML_SCALAR ? "an empty one" : kind_name(node));
    return NULL;
}

static bool is_letter(char c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || (c & 0x80);
}

const char *kmp_read_name(kmp_reader *r, const kmp_yaml *node, const char *what)
{
    const char *name = kmp_read_word(r, node, what);
    bool good = name && is_letter(name[0]);
    for (const char *s = name; good && *s; s++)
        good = is_letter(*s) || (*s >= '0' && *s <= '9');
    if (name && !good)
        kmp_reader_complain(
            r, node->place,
            "%s cannot be '%s': a name consists of letters, digits and _ and does not begin with a digit", what, name);
    return good ? name : NULL;
}

const kmp_yaml *kmp_read_required(kmp_reader *r, const kmp_yaml *map, const char *what, const char *key)
{
    const kmp_yaml *value = kmp_yaml_get(map, key);
    if (!value)
        kmp_reader_complain(r, map->place, "%s has no key '%s'", what, key);
    return value;
}
