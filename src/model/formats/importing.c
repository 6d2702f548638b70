/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/formats/formats.h"
#include <string.h>

/* Kinds of parts that are named; further ones are counted. */
enum { MOST_KINDS = 40 };

typedef struct format {
    const char *outermost, *ending;
    void (*convert)(kmp_import *import);
    const char *name;
} format;

static const format formats[] = {
#define KMP_FORMAT(outermost, ending, convert, name) {outermost, ending, convert, name},
#include "model/formats/formats.def"
};

static const struct {
    const char *key;
    void (*convert)(kmp_import *import);
} keyed[] = {
#define KMP_FORMAT_OF_KEY(key, convert) {key, convert},
#include "model/formats/formats.def"
};

enum { FORMATS = sizeof formats / sizeof *formats };

/* -- formats ------------------------------------------------------------------------------------------- */

static bool ends_with(const char *name, const char *ending)
{
    size_t length = strlen(name), tail = strlen(ending);
    return length > tail && strcmp(name + length - tail, ending) == 0;
}

/* No model in YAML begins with this sign. */
static bool is_xml(const char *text, size_t length)
{
    static const char mark[] = "\xef\xbb\xbf"; /* of UTF-8 */
    size_t at = length >= 3 && memcmp(text, mark, 3) == 0 ? 3 : 0;
    while (at < length && strchr(" \t\r\n", text[at]) && text[at])
        at++;
    return at < length && text[at] == '<';
}

bool kmp_is_foreign(const char *file, const char *text, size_t length)
{
    bool foreign = is_xml(text, length);
    for (int k = 0; k < FORMATS; k++)
        foreign = foreign || ends_with(file, formats[k].ending);
    return foreign;
}

/* "the outermost element is 'x': models begin with 'mbsDescR7' (ROBOTRAN), .. or 'sdf' (SDFormat)" */
static kempe_status refuse(const kmp_import *im, const kmp_element *outermost)
{
    kmp_text known = {0};
    for (int k = 0; k < FORMATS; k++)
        kmp_text_printf(&known, "%s'%s' (%s)",
                        k == 0            ? ""
                        : k < FORMATS - 1 ? ", "
                                          : " or ",
                        formats[k].outermost, formats[k].name);
    kmp_place place = outermost ? outermost->place : (kmp_place){.line = 1, .column = 1};
    kempe_status status =
        known.failed ? kmp_fail_memory(im->context)
                     : kmp_complain(im->context, im->file, place.line, place.column,
                                    "the outermost element is %s%s%s: models begin with %s", outermost ? "'" : "",
                                    outermost ? outermost->name : "a drawing", outermost ? "'" : "", known.s);
    kmp_text_free(&known);
    return status;
}

/* A document with errors is none: the reader would report them again. */
static kempe_status end_conversion(kmp_import *im, const kmp_yaml **root)
{
    if (im->status == KEMPE_OK && im->refused)
        im->status = KEMPE_E_INPUT;
    *root = im->status == KEMPE_OK ? im->root : NULL;
    return im->arena->failed ? kmp_fail_memory(im->context) : im->status;
}

kempe_status kmp_foreign_load(kempe_context *context, kmp_arena *arena, const char *file, int number, const char *text,
                              size_t length, kmp_base base, const kmp_beside *beside, const kmp_yaml **root)
{
    static const char *const drawing[] = {"graphics", "x3D", NULL}; /* in models of ROBOTRAN */
    kmp_import im = {.context = context, .arena = arena, .file = file, .base = base, .beside = beside};
    const format *found = NULL;
    *root = NULL;
    kempe_status status = kmp_xml_load(context, arena, file, number, text, length, drawing, &im.model);
    if (status != KEMPE_OK)
        return status;
    for (int k = 0; k < FORMATS && im.model; k++)
        if (strcmp(im.model->name, formats[k].outermost) == 0)
            found = &formats[k];
    if (!found)
        return refuse(&im, im.model);
    im.root = kmp_import_map(&im, im.model->place);
    kmp_import_word(&im, im.root, im.model->place, "kempe", "1");
    if (im.root)
        found->convert(&im);
    return end_conversion(&im, root);
}

kempe_status kmp_foreign_convert(kempe_context *context, kmp_arena *arena, const char *file, kmp_base base,
                                 const kmp_beside *beside, const kmp_yaml **root)
{
    kmp_import im = {.context = context, .arena = arena, .file = file, .base = base, .beside = beside, .source = *root};
    for (size_t k = 0; k < sizeof keyed / sizeof *keyed; k++) {
        if (kmp_yaml_get(im.source, "kempe") || !kmp_yaml_get(im.source, keyed[k].key))
            continue;
        im.root = kmp_import_map(&im, im.source->place);
        kmp_import_word(&im, im.root, im.source->place, "kempe", "1");
        if (im.root)
            keyed[k].convert(&im);
        return end_conversion(&im, root);
    }
    return arena->failed ? kmp_fail_memory(context) : KEMPE_OK;
}

/* -- nodes --------------------------------------------------------------------------------------------- */

/* A model may include other files. */
static const char *file_of(const kmp_import *im, kmp_place place)
{
    return im->beside->name(im->beside->user, place.file);
}

void kmp_import_complain(kmp_import *im, kmp_place place, const char *what, const char *name, const char *sentence)
{
    im->status = kmp_complain(im->context, file_of(im, place), place.line, place.column, "%s '%s' %s", what,
                              name ? name : "", sentence);
}

kmp_yaml *kmp_import_map(kmp_import *im, kmp_place place)
{
    return kmp_yaml_new(im->arena, KMP_YAML_MAP, place);
}

void kmp_import_put(kmp_import *im, kmp_yaml *map, kmp_place place, const char *key, const kmp_yaml *item)
{
    kmp_yaml_put(im->arena, map, place, key, item);
}

void kmp_import_word(kmp_import *im, kmp_yaml *map, kmp_place place, const char *key, const char *word)
{
    kmp_import_put(im, map, place, key, kmp_yaml_word(im->arena, place, word));
}

const char *kmp_import_number(kmp_import *im, double value)
{
    return kmp_arena_printf(im->arena, "%.17g", value);
}

kmp_yaml *kmp_import_numbers(kmp_import *im, kmp_place place, int count, const double *values)
{
    kmp_yaml *list = kmp_yaml_new(im->arena, KMP_YAML_LIST, place);
    for (int k = 0; k < count; k++)
        kmp_yaml_append(im->arena, list, NULL, kmp_yaml_word(im->arena, place, kmp_import_number(im, values[k])));
    return list;
}

kmp_yaml *kmp_import_part(kmp_import *im, kmp_yaml *map, const char *key, kmp_yaml_kind kind)
{
    kmp_yaml *there = (kmp_yaml *)kmp_yaml_get(map, key);
    if (there || !map)
        return there;
    there = kmp_yaml_new(im->arena, kind, map->place);
    kmp_import_put(im, map, map->place, key, there);
    return there;
}

void kmp_import_add(kmp_import *im, const char *section, const kmp_element *from, const char *name,
                    const kmp_yaml *entry)
{
    kmp_yaml *map = kmp_import_part(im, im->root, section, KMP_YAML_MAP);
    if (kmp_yaml_get(map, name))
        kmp_import_complain(im, from->place, from->name, name, "exists twice in the model: names must be unique");
    else
        kmp_import_put(im, map, from->place, name, entry);
}

/* -- names --------------------------------------------------------------------------------------------- */

bool kmp_import_is_letter(char c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || (c & 0x80);
}

const char *kmp_import_clean(kmp_import *im, const char *name)
{
    kmp_text text = {0};
    if ((name[0] >= '0' && name[0] <= '9') || !name[0] || strcmp(name, "ground") == 0)
        kmp_text_put(&text, "_");
    kmp_text_put(&text, name);
    for (char *s = text.failed ? NULL : text.s; s && *s; s++)
        *s = kmp_import_is_letter(*s) ? *s : '_';
    return kmp_text_keep(&text, im->arena);
}

/* -- notes --------------------------------------------------------------------------------------------- */

void kmp_import_leave_out(kmp_import *im, kmp_place place, const char *sentence, ...)
{
    kmp_text words = {0};
    KMP_TEXT_ARGUMENTS(&words, sentence);
    if (words.failed)
        im->arena->failed = true;
    else if (kmp_context_is_strict(im->context))
        im->refused =
            kmp_complain(im->context, file_of(im, place), place.line, place.column, "%s", words.s) != KEMPE_OK;
    else
        kmp_log(im->context, KEMPE_LOG_WARNING, "%s:%d:%d: %s", file_of(im, place), place.line, place.column, words.s);
    kmp_text_free(&words);
}

static bool is_word_of(const char *words, const char *name)
{
    size_t length = strlen(name);
    for (const char *at = strstr(words, name); at; at = strstr(at + 1, name))
        if (at > words && at[-1] == ' ' && at[length] == ' ')
            return true;
    return false;
}

/* A kind of parts that are not read: an element or attribute and the element around it. */
typedef struct unknown {
    const kmp_element *first;
    const char *in;
    int count;
    struct unknown *next;
} unknown;

typedef struct search {
    kmp_import *im;
    const kmp_grammar *grammar;
    size_t rows;
    unknown *found, **end;
    int kinds, rest;
} search;

static void take(search *s, const kmp_element *e, const char *in)
{
    unknown *u = s->found;
    while (u && (strcmp(u->first->name, e->name) != 0 || strcmp(u->in, in) != 0))
        u = u->next;
    if (u) {
        u->count++;
        return;
    }
    u = s->kinds < MOST_KINDS ? KMP_ARENA_NEW(s->im->arena, unknown, 1) : NULL;
    if (!u) {
        s->rest++;
        return;
    }
    s->kinds++;
    *u = (unknown){.first = e, .in = in, .count = 1};
    *s->end = u;
    s->end = &u->next;
}

static void look(search *s, const kmp_element *element)
{
    const char *known = NULL;
    for (size_t k = 0; k < s->rows; k++)
        if (strcmp(s->grammar[k].in, element->name) == 0)
            known = s->grammar[k].known;
    for (const kmp_element *e = element->first; known && e; e = e->next) {
        if (is_word_of(known, e->name))
            look(s, e);
        else
            take(s, e, element->name);
    }
}

static const char *remedy_of(const kmp_element *e, const kmp_remedy *remedies, size_t count)
{
    for (size_t k = 0; k < count; k++)
        if (strcmp(remedies[k].part, e->name) == 0)
            return remedies[k].words;
    return NULL;
}

static const char *times_of(kmp_import *im, int count)
{
    const char *words = count > 1 ? kmp_arena_printf(im->arena, " (%d times)", count) : "";
    return words ? words : "";
}

void kmp_import_note_unknown(kmp_import *im, const kmp_grammar *grammar, size_t rows, const kmp_remedy *remedies,
                             size_t remedy_count)
{
    search s = {.im = im, .grammar = grammar, .rows = rows};
    s.end = &s.found;
    look(&s, im->model);
    for (const unknown *u = s.found; u; u = u->next) {
        const char *remedy = remedy_of(u->first, remedies, remedy_count);
        kmp_import_leave_out(im, u->first->place, "'%s' in '%s' is not used%s%s%s", u->first->name, u->in,
                             times_of(im, u->count), remedy ? ": " : "", remedy ? remedy : "");
    }
    if (im->limited > 0)
        kmp_import_leave_out(im, im->first_limit, "limits of motion are not used%s: --joint-limits makes them stops",
                             times_of(im, im->limited));
    if (s.rest > 0)
        kmp_import_leave_out(im, im->model->place, "%d parts of further kinds are not used", s.rest);
}
