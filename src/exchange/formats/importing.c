/* SPDX-License-Identifier: BSD-3-Clause */
#include "exchange/formats/importing.h"
#include "base/arena.h"
#include "base/context.h"
#include "base/text.h"
#include "exchange/formats/formats.h"
#include <kempe/kempe.h>
#include <stdbool.h>
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
#include "exchange/formats/formats.def"
};

static const struct {
    const char *key;
    void (*convert)(kmp_import *import);
} keyed[] = {
#define KMP_FORMAT_OF_KEY(key, convert) {key, convert},
#include "exchange/formats/formats.def"
};

enum { FORMATS = sizeof formats / sizeof *formats };

/* -- formats ------------------------------------------------------------------------------------------- */

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
    const size_t all = strlen(file);
    for (int k = 0; k < FORMATS && !foreign; k++) {
        const size_t tail = strlen(formats[k].ending);
        foreign = all > tail && strcmp(file + all - tail, formats[k].ending) == 0;
    }
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
                              size_t length, kmp_base base, const kmp_include_files *beside, const kmp_yaml **root)
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
    im.format = found->name;
    if (im.root) {
        found->convert(&im);
        kmp_import_note_unknown(&im);
    }
    return end_conversion(&im, root);
}

kempe_status kmp_foreign_convert(kempe_context *context, kmp_arena *arena, const char *file, kmp_base base,
                                 const kmp_include_files *beside, const kmp_yaml **root)
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

static const char *number(kmp_import *im, double value)
{
    return kmp_arena_printf(im->arena, "%.17g", value);
}

kmp_yaml *kmp_import_numbers(kmp_import *im, kmp_place place, int count, const double *values)
{
    kmp_yaml *list = kmp_yaml_new(im->arena, KMP_YAML_LIST, place);
    for (int k = 0; k < count; k++)
        kmp_yaml_append(im->arena, list, NULL, kmp_yaml_word(im->arena, place, number(im, values[k])));
    return list;
}

void kmp_import_value(kmp_import *im, kmp_yaml *map, kmp_place place, const char *key, double value)
{
    kmp_import_word(im, map, place, key, number(im, value));
}

void kmp_import_vector(kmp_import *im, kmp_yaml *map, kmp_place place, const char *key, const double v[3])
{
    kmp_import_put(im, map, place, key, kmp_import_numbers(im, place, 3, v));
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

void kmp_import_leave_out(kmp_import *im, kmp_place place, kmp_part_class kind, const char *part, const char *sentence,
                          ...)
{
    bool mechanics = kind == KMP_PART_MECHANICS, allowed = kmp_context_leaves_out(im->context, part);
    const char *file = file_of(im, place);
    kmp_text words = {0};
    KMP_TEXT_ARGUMENTS(&words, sentence);
    if (mechanics && allowed)
        kmp_text_put(&words, "; the machine differs from the file");
    else if (mechanics)
        kmp_text_printf(&words, "; without it the machine is another one: --leave-out %s allows that", part);
    if (words.failed)
        im->arena->failed = true;
    else if (!allowed && (mechanics || (kind == KMP_PART_AT_TIMES && kmp_context_is_strict(im->context))))
        im->refused = kmp_complain(im->context, file, place.line, place.column, "%s", words.s) != KEMPE_OK;
    else if (kind == KMP_PART_REMARK)
        kmp_log(im->context, KEMPE_LOG_INFO, "%s:%d:%d: %s", file, place.line, place.column, words.s);
    else {
        const char *line = kmp_arena_printf(im->arena, "%s:%d:%d: %s", file, place.line, place.column, words.s);
        if (line) {
            kmp_log(im->context, KEMPE_LOG_WARNING, "%s", line);
            im->beside->note(im->beside->user, line, mechanics);
        }
    }
    kmp_text_free(&words);
}

/* Rows of grammar.def. */
static const struct {
    const char *format, *in;
    kmp_part_class kind;
    const char *words;
} grammar[] = {
#define KMP_PARTS(format, in, kind, words) {format, in, KMP_PART_##kind, " " words " "},
#include "exchange/formats/grammar.def"
};

static const struct {
    const char *part, *words;
} remedies[] = {
#define KMP_REMEDY(part, words) {part, words},
#include "exchange/formats/grammar.def"
#include "model/data/place.h"
};

enum { ROWS = sizeof grammar / sizeof *grammar, REMEDIES = sizeof remedies / sizeof *remedies };

bool kmp_import_is_word(const char *words, const char *name)
{
    size_t length = strlen(name);
    for (const char *at = strstr(words, name); at; at = strstr(at + 1, name))
        if (at > words && at[-1] == ' ' && at[length] == ' ')
            return true;
    return false;
}

/* The class of an element or attribute in another one, of which all is read if it has no rows. */
static kmp_part_class class_of(const kmp_import *im, const char *in, const char *name)
{
    bool known = false;
    for (int k = 0; k < ROWS; k++) {
        const char *around = grammar[k].in;
        bool own = *around == *in && strcmp(around, in) == 0;
        if ((!own && *around != '*') || strcmp(grammar[k].format, im->format) != 0)
            continue;
        if (kmp_import_is_word(grammar[k].words, name))
            return grammar[k].kind;
        known = known || own;
    }
    return known && strncmp(name, "xmlns", 5) != 0 ? KMP_PART_MECHANICS : KMP_PART_READ;
}

/* A value that is none: zeros, or a word for no. */
static bool is_nothing(const kmp_element *e)
{
    static const char *const none[] = {"false", "disable", "none", "no"};
    bool nothing = e->text[0] && !e->first;
    for (size_t k = 0; k < sizeof none / sizeof *none; k++)
        if (strcmp(e->text, none[k]) == 0)
            return true;
    for (const char *at = e->text; nothing && *at; at++)
        nothing = strchr("0. \t\r\n+-", *at);
    return nothing;
}

/* A kind of parts that are not read: an element or attribute and the element around it. */
typedef struct unknown {
    const kmp_element *first;
    const char *in;
    kmp_part_class kind;
    int count;
    struct unknown *next;
} unknown;

typedef struct search {
    kmp_import *im;
    unknown *found, **end;
    int kinds, rest;
    const kmp_element *first_rest;
} search;

static void take(search *s, const kmp_element *e, const char *in, kmp_part_class kind)
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
        s->first_rest = s->rest++ == 0 ? e : s->first_rest;
        return;
    }
    s->kinds++;
    *u = (unknown){.first = e, .in = in, .kind = kind, .count = 1};
    *s->end = u;
    s->end = &u->next;
}

static void look(search *s, const kmp_element *element)
{
    for (const kmp_element *e = element->first; e; e = e->next) {
        kmp_part_class kind = class_of(s->im, element->name, e->name);
        if (kind == KMP_PART_READ)
            look(s, e);
        else if (kind != KMP_PART_WHOLE && !is_nothing(e))
            take(s, e, element->name, kind);
    }
}

static const char *times_of(kmp_import *im, int count)
{
    const char *words = count > 1 ? kmp_arena_printf(im->arena, " (%d times)", count) : "";
    return words ? words : "";
}

void kmp_import_note_unknown(kmp_import *im)
{
    search s = {.im = im};
    s.end = &s.found;
    if (im->model)
        look(&s, im->model);
    for (const unknown *u = s.found; u; u = u->next) {
        const char *remedy = NULL;
        for (int k = 0; k < REMEDIES && !remedy; k++)
            remedy = strcmp(remedies[k].part, u->first->name) == 0 ? remedies[k].words : NULL;
        kmp_import_leave_out(im, u->first->place, u->kind, u->first->name, "'%s' in '%s' is not used%s%s%s",
                             u->first->name, u->in, times_of(im, u->count), remedy ? ": " : "", remedy ? remedy : "");
    }
    if (im->limited > 0)
        kmp_import_leave_out(im, im->first_limit, KMP_PART_AT_TIMES, "limit",
                             "limits of motion are not used%s: --joint-limits makes them stops",
                             times_of(im, im->limited));
    if (s.rest > 0)
        kmp_import_leave_out(im, s.first_rest->place, KMP_PART_MECHANICS, s.first_rest->name,
                             "'%s' and %d parts of further kinds are not used", s.first_rest->name, s.rest - 1);
}
