/* SPDX-License-Identifier: BSD-3-Clause */
/* Completion. The text before the cursor decides: a mark is put there, open brackets and
 * quotes are closed, and the reader of YAML gives the node of the mark. Names are from the last document that could be
 * read. */
#include "base/context.h"
#include "language_server/language_words.h"
#include "language_server/node_search.h"
#include "language_server/session.h"
#include "model/files/element_library.h"
#include "model/language/expression.h"
#include "model/language/limits.h"
#include "platform/platform.h"
#include <string.h>

#define MARK "KEMPE_CURSOR"

/* -- the text before the cursor ----------------------------------------------------------------------- */

/* Brackets, quotes and the line at the end of a text. */
typedef struct text_end {
    char open[KMP_MOST_BRACKETS + 1];   /* brackets that are not closed */
    bool valued[KMP_MOST_BRACKETS + 1]; /* a colon was there since the last comma */
    int depth;
    char quote; /* '\0': none is open */
    bool comment;
    bool line_valued; /* outside of brackets a colon was in the line */
} text_end;

static bool begins_scalar(const char *text, size_t k)
{
    while (k > 0 && (text[k - 1] == ' ' || text[k - 1] == '\t'))
        k--;
    return k == 0 || strchr("\n\r[{,:-", text[k - 1]);
}

static void take_bracket(text_end *e, char c)
{
    if ((c == '[' || c == '{') && e->depth < KMP_MOST_BRACKETS) {
        e->open[++e->depth] = c;
        e->valued[e->depth] = false;
    } else if ((c == ']' || c == '}') && e->depth > 0) {
        e->depth--;
    } else if (c == ',') {
        e->valued[e->depth] = false;
    }
}

static text_end scan(const char *text, size_t length)
{
    text_end e = {.depth = 0};
    for (size_t k = 0; k < length; k++) {
        const char c = text[k];
        const bool apart = k == 0 || strchr(" \t\n\r", text[k - 1]);
        if (c == '\n' && e.depth == 0)
            e.line_valued = false;
        if (e.comment) {
            e.comment = c != '\n';
        } else if (e.quote) {
            k += e.quote == '"' && c == '\\';
            e.quote = c == e.quote ? '\0' : e.quote;
        } else if ((c == '"' || c == '\'') && begins_scalar(text, k)) {
            e.quote = c;
        } else if (c == '#' && apart) {
            e.comment = true;
        } else if (c == ':' && (k + 1 == length || strchr(" \t\n\r", text[k + 1]))) {
            if (e.depth > 0)
                e.valued[e.depth] = true;
            else
                e.line_valued = true;
        } else if (e.depth > 0 || begins_scalar(text, k)) {
            take_bracket(&e, c);
        }
    }
    return e;
}

static bool is_marked(const void *unused, const kmp_yaml *node)
{
    (void)unused;
    return strstr(node->text, MARK) != NULL;
}

/* The node of a mark behind `length` bytes, as a key or as a value; *document: with it. */
static kmp_found_node find_mark(kempe_language_server *s, const char *text, size_t length, const text_end *e,
                                bool as_key, kmp_text_source *document)
{
    kmp_text marked = {0};
    kmp_text_append(&marked, text, length);
    kmp_text_put(&marked, MARK);
    if (e->quote)
        kmp_text_append(&marked, &e->quote, 1);
    if (as_key)
        kmp_text_put(&marked, ": ");
    for (int k = e->depth; k > 0; k--)
        kmp_text_put(&marked, e->open[k] == '[' ? "]" : "}");
    kmp_text_put(&marked, "\n");
    document->text = kmp_text_keep(&marked, &s->work);
    document->root = document->text ? kmp_session_parse(s, &s->work, document->text) : NULL;
    return kmp_node_find(s->schema, document->root, is_marked, NULL);
}

/* -- items -------------------------------------------------------------------------------------------- */

enum {
    TEXT_ITEM = 1,
    FUNCTION_ITEM = 3,
    VARIABLE_ITEM = 6,
    PROPERTY_ITEM = 10,
    UNIT_ITEM = 11,
    VALUE_ITEM = 12,
    FILE_ITEM = 17
};

/* A request in work: an item replaces these bytes of the text. */
typedef struct completing {
    kempe_language_server *s;
    kmp_open_file *file;
    kmp_reply *answer;
    size_t begin, end;
    kmp_found_node found;
    kmp_text_source marked; /* the document up to the cursor */
    kmp_model_names names;
} completing;

static void put_item(completing *c, const char *label, int kind, const char *detail, const char *meaning,
                     const char *inserted)
{
    kmp_json *json = &c->answer->json;
    kmp_json_object(json, NULL);
    kmp_json_put(json, "label %s kind %d", label, kind);
    if (*detail)
        kmp_json_string(json, "detail", detail);
    if (*meaning)
        kmp_json_string(json, "documentation", meaning);
    kmp_json_object(json, "textEdit");
    kmp_put_range(c->s, json, "range", c->file->text, c->begin, c->end);
    kmp_json_string(json, "newText", inserted);
    kmp_json_end(json);
    kmp_json_end(json);
}

static void put_keys(completing *c, const kmp_schemas *schemas, const kmp_yaml *map)
{
    for (int k = 0; k < schemas->count; k++) {
        const kmp_json_value *known = kmp_json_member(schemas->one[k].rules, "properties");
        for (int i = 0; known && i < known->count; i++) {
            const char *meaning = kmp_json_word(known->items[i], "description"),
                       *inserted = kmp_arena_printf(&c->s->work, "%s: ", known->keys[i]);
            if (inserted && !kmp_yaml_get(map, known->keys[i]))
                put_item(c, known->keys[i], PROPERTY_ITEM, "", meaning ? meaning : "", inserted);
        }
    }
}

/* Words of an enumeration, and words that a meaning has as examples. */
static void put_values(completing *c, const kmp_schema *schema)
{
    const char *const lists[] = {"enum", "examples"};
    for (int k = 0; k < 2; k++) {
        const kmp_json_value *list = kmp_json_member(schema->rules, lists[k]);
        for (int i = 0; list && i < list->count; i++)
            if (list->items[i]->kind == KMP_JSON_STRING)
                put_item(c, list->items[i]->text, VALUE_ITEM, "", schema->meaning, list->items[i]->text);
    }
}

static void put_names(completing *c, kmp_name_set of, const char *owner)
{
    const kmp_model_names *n = &c->names;
    for (int k = 0; k < n->count; k++) {
        const kmp_declared *d = &n->declared[k];
        const bool owned = d->kind == KMP_NAME_POINT || d->kind == KMP_NAME_INTERFACE;
        const bool fits = owned ? owner && strcmp(owner, d->owner) == 0 : !owner;
        const char *inserted = d->kind == KMP_NAME_PORT ? kmp_arena_printf(&c->s->work, "port.%s", d->name) : d->name;
        if ((of & 1U << d->kind) && fits && inserted && !(d->kind == KMP_NAME_PORT && d->include >= 0))
            put_item(c, inserted, VARIABLE_ITEM, kmp_name_rows[d->kind].word, "", inserted);
    }
    if (of & KMP_NAMES_IN(BODY) && !owner)
        put_item(c, "ground", VARIABLE_ITEM, "body", "", "ground");
}

/* Names of an included file, as that has them; the include may be new. */
static void put_included(completing *c, kmp_name_set of)
{
    kmp_model_names names;
    kmp_names_find(&names, c->s->schema, &c->marked, kmp_session_beside, c->s);
    for (int k = 0; k < names.count; k++) {
        const kmp_declared *d = &names.declared[k];
        const char *own = d->name + d->prefix,
                   *inserted = c->found.is_key ? kmp_arena_printf(&c->s->work, "%s: ", own) : own;
        if (d->include == c->found.include && (of & 1U << d->kind) && inserted)
            put_item(c, own, VARIABLE_ITEM, kmp_name_rows[d->kind].word, "", inserted);
    }
    kmp_names_free(&names);
}

static void put_words(completing *c, bool outputs)
{
    kmp_language_word word;
    const char *last = "";
    for (int k = 0; kmp_language_word_at(k, &word); k++) {
        const bool fits =
            outputs ? word.kind == KMP_WORD_OUTPUT : word.kind != KMP_WORD_OUTPUT && word.kind != KMP_WORD_UNIT;
        const char *inserted = kmp_arena_printf(&c->s->work, word.called && !outputs ? "%s(" : "%s", word.name);
        if (fits && inserted && strcmp(last, word.name) != 0)
            put_item(c, word.name, word.called ? FUNCTION_ITEM : VARIABLE_ITEM, word.form, word.meaning, inserted);
        last = word.name;
    }
}

static void put_units(completing *c)
{
    kmp_language_word word;
    for (int k = 0; kmp_language_word_at(k, &word); k++)
        if (word.kind == KMP_WORD_UNIT)
            put_item(c, word.name, UNIT_ITEM, word.meaning, "", word.name);
}

/* Files of the folder and, for an include, elements of the library. */
static void put_files(completing *c, bool models)
{
    const char *slash = strrchr(c->file->path, '/');
    const char *folder =
        slash ? kmp_arena_printf(&c->s->work, "%.*s", (int)(slash + 1 - c->file->path), c->file->path) : NULL;
    kmp_folder_names *names = folder ? kmp_folder_names_begin(folder) : NULL;
    for (const char *name; names && (name = kmp_folder_names_next(names));) {
        const char *ending = strrchr(name, '.');
        const bool model = ending && (strcmp(ending, ".yaml") == 0 || strcmp(ending, ".yml") == 0);
        if (name[0] != '.' && model == models && strcmp(name, slash + 1) != 0 &&
            !kmp_context_beyond(c->s->context, kmp_arena_printf(&c->s->work, "%s%s", folder, name)))
            put_item(c, name, FILE_ITEM, "", "", name);
    }
    if (names)
        kmp_folder_names_end(names);
    for (const kmp_machine_element *e = kmp_elements; models && e->name; e++) {
        kmp_text head = {0};
        for (int k = 0; e->lines[k] && e->lines[k][0] == '#'; k++)
            kmp_text_put(&head, e->lines[k] + 1 + (e->lines[k][1] == ' '));
        put_item(c, e->name, FILE_ITEM, "machine element", head.s ? head.s : "", e->name);
        kmp_text_free(&head);
    }
}

/* -- expressions -------------------------------------------------------------------------------------- */

/* The names that may follow a part of an expression, by the call that is open; units behind a number. */
static kmp_name_set names_behind(const char *text, bool *units)
{
    enum { MOST = 64 };
    kmp_name_set call[MOST + 1] = {KMP_NAMES_OF_EXPRESSION};
    int level = 0;
    *units = false;
    for (size_t k = 0; text[k];) {
        double value;
        const size_t number = kmp_text_to_number(text + k, &value), word = kmp_parse_word_length(text + k);
        *units = false;
        if (number > 0) {
            const size_t end = k + number, behind = kmp_units_end(text, end);
            *units =
                (behind == end && text[end] == ' ') || (behind > end && strchr("*/", text[behind]) && text[behind]);
            k = behind > end && *units ? behind + 1 : behind;
            k += strspn(text + k, " ");
        } else if (word > 0) {
            const bool called = text[k + word] == '(' && level < MOST;
            if (called)
                call[++level] = kmp_names_of_call(text + k, word);
            k += word + called;
        } else {
            if (text[k] == '(' && level < MOST) {
                level++;
                call[level] = call[level - 1];
            } else if (text[k] == ')' && level > 0) {
                level--;
            }
            k++;
        }
    }
    return call[level];
}

static void put_expression(completing *c, const char *before, const char *owner, bool outputs)
{
    bool units;
    const kmp_name_set of = names_behind(before, &units);
    if (units) {
        put_units(c);
    } else if (owner) {
        put_names(c, KMP_NAMES_IN(POINT), owner);
    } else if (of & KMP_NAMES_OF_EXPRESSION) {
        put_names(c, KMP_NAMES_OF_VALUES & (outputs ? KMP_NAMES_IN(SENSOR) : KMP_NAMES_ALL), NULL);
        put_words(c, outputs);
    } else {
        put_names(c, of, NULL);
    }
}

/* -- all of them -------------------------------------------------------------------------------------- */

/* The word with a dot right before the completed one: `arm` of `arm.ti`; NULL: there is none. */
static const char *owner_before(completing *c)
{
    const char *text = c->file->text;
    if (c->begin == 0 || text[c->begin - 1] != '.')
        return NULL;
    size_t begin = c->begin - 1;
    while (begin > 0 && (kmp_parse_word_length(text + begin - 1) > 0 || strchr("0123456789", text[begin - 1])))
        begin--;
    return kmp_arena_printf(&c->s->work, "%.*s", (int)(c->begin - 1 - begin), text + begin);
}

static void put_kind(completing *c, const kmp_schema *schema, const char *before, const char *owner)
{
    const kmp_name_set of = kmp_names_of_value(schema->kind);
    const bool file = strcmp(schema->kind, "file_name") == 0, model = strcmp(schema->kind, "included_file_name") == 0;
    if (file || model) {
        c->begin -= strlen(before);
        put_files(c, model);
    } else if (strncmp(schema->kind, "included_", 9) == 0) {
        put_included(c, of);
    } else if (of & KMP_NAMES_OF_EXPRESSION) {
        put_expression(c, before, owner, strcmp(schema->kind, "output_name") == 0);
    } else if (of) {
        const bool own = of == KMP_NAMES_IN(POINT) || of == KMP_NAMES_IN(INTERFACE);
        put_names(c, owner ? KMP_NAMES_IN(POINT) : of, owner ? owner : own ? c->found.owner : NULL);
    }
}

static void put_items(completing *c, const text_end *e)
{
    const kmp_found_node *found = &c->found;
    const char *mark = strstr(found->node->text, MARK);
    const char *before = kmp_arena_printf(&c->s->work, "%.*s", (int)(mark - found->node->text), found->node->text);
    const char *owner = owner_before(c);
    if (!before)
        return;
    if (found->is_key) {
        const char *kind = kmp_schema_key_kind(&found->schemas);
        put_keys(c, &found->schemas, found->map);
        if (*kind)
            put_kind(c, &(kmp_schema){.kind = kind, .meaning = ""}, before, owner);
        return;
    }
    for (int k = 0; k < found->schemas.count; k++) {
        const kmp_schema *schema = &found->schemas.one[k];
        const size_t begin = c->begin;
        put_values(c, schema);
        put_kind(c, schema, before, owner);
        c->begin = begin;
    }
    if (e->depth == 0 && !e->line_valued)
        put_keys(c, &found->schemas, NULL);
}

void kmp_answer_completion(kempe_language_server *s, kmp_open_file *file, size_t offset, kmp_reply *answer)
{
    const char *text = file->text;
    completing c = {.s = s, .file = file, .answer = answer, .begin = offset, .end = offset};
    while (c.begin > 0 && (kmp_parse_word_length(text + c.begin - 1) > 0 || strchr("0123456789", text[c.begin - 1])))
        c.begin--;
    const text_end e = scan(text, c.begin);
    kmp_json_array(&answer->json, NULL);
    if (!e.comment) {
        c.marked.path = file->path;
        const bool valued = e.depth > 0 ? e.valued[e.depth] || e.open[e.depth] == '[' : e.line_valued;
        const bool as_key = !valued && !e.quote;
        const kmp_found_node first = find_mark(s, text, c.begin, &e, as_key, &c.marked);
        c.found = first.node ? first : find_mark(s, text, c.begin, &e, !as_key && !e.quote, &c.marked);
        const kmp_text_source *source = file->good.root ? &file->good : &c.marked;
        kmp_names_find(&c.names, s->schema, source, kmp_session_beside, s);
        if (c.found.node)
            put_items(&c, &e);
        else
            put_expression(&c, "", owner_before(&c), false);
        kmp_names_free(&c.names);
    }
    kmp_json_end(&answer->json);
}
