/* SPDX-License-Identifier: BSD-3-Clause */
/* libyaml's document, node by node, into an arena. Nodes are numbered by libyaml, so that references become
 * pointers without recursion, also when an alias makes a cycle. */
#include "model/files/yaml.h"
#include "model/files/nodes.h"
#include "model/language/limits.h"
#include <ctype.h>
#include <string.h>
#include <yaml.h>

typedef struct loader {
    kempe_context *context;
    kmp_arena *arena;
    const char *file;
    int number; /* of the file, for places */
    yaml_document_t document;
    kmp_yaml *nodes;
    kempe_status status;
} loader;

static kmp_place place_of(yaml_mark_t mark)
{
    return (kmp_place){.line = (int)mark.line + 1, .column = (int)mark.column + 1};
}

static void complain(loader *l, kmp_place place, const char *sentence, const char *name)
{
    l->status = kmp_complain(l->context, l->file, place.line, place.column, "%s%s", sentence, name);
}

/* -- syntax -------------------------------------------------------------------------------------- */

/* Place of a byte, for errors of the encoding, which libyaml reports without one. */
static kmp_place place_at(const char *text, size_t length, size_t offset)
{
    kmp_place place = {.line = 1, .column = 1};
    for (size_t i = 0; i < offset && i < length; i++) {
        if (text[i] == '\n') {
            place.line++;
            place.column = 1;
        } else {
            place.column += ((unsigned char)text[i] & 0xc0) != 0x80;
        }
    }
    return place;
}

/* True if a tab is among the characters with which a line begins. */
static bool is_indented_by_tab(const char *text, size_t length, size_t line)
{
    size_t i = 0;
    for (; i < length && line > 1; i++)
        line -= text[i] == '\n';
    while (i < length && text[i] == ' ')
        i++;
    return i < length && text[i] == '\t';
}

/* The remedy of an error of the parser; "": none is known. */
static const char *remedy_of(const char *problem, bool tab)
{
    if (tab)
        return "; lines are indented by blanks, not by tabs";
    static const struct {
        const char *problem, *remedy;
    } known[] = {{"did not find expected key", "; the keys of one mapping begin in the same column"},
                 {"tab character", "; lines are indented by blanks"},
                 {"mapping values are not allowed",
                  "; keys of one mapping begin in the same column, a blank follows each ':', and texts with ': ' need "
                  "quotes"},
                 {"undefined alias", "; an expression that begins with '*' needs quotes"},
                 {"cannot start any token", "; a text that begins with this character needs quotes"},
                 {"unexpected end of stream", "; the quote is not closed"},
                 {"expected ',' or ", "; the bracket is not closed, or a comma is missing"}};
    for (size_t k = 0; k < sizeof known / sizeof *known; k++)
        if (strstr(problem, known[k].problem))
            return known[k].remedy;
    return "";
}

static void complain_syntax(loader *l, const yaml_parser_t *parser, const char *text, size_t length)
{
    if (parser->error == YAML_MEMORY_ERROR) {
        l->status = kmp_fail_memory(l->context);
        return;
    }
    const char *problem = parser->problem ? parser->problem : "not readable";
    kmp_place place = parser->error == YAML_READER_ERROR ? place_at(text, length, parser->problem_offset)
                                                         : place_of(parser->problem_mark);
    const char *remedy = remedy_of(problem, is_indented_by_tab(text, length, (size_t)place.line));
    if (parser->context)
        l->status =
            kmp_complain(l->context, l->file, place.line, place.column, "YAML: %s (%s that begins at line %zu)%s",
                         problem, parser->context, parser->context_mark.line + 1, remedy);
    else
        l->status = kmp_complain(l->context, l->file, place.line, place.column, "YAML: %s%s", problem, remedy);
}

/* -- nodes --------------------------------------------------------------------------------------- */

static void copy_scalar(loader *l, const yaml_node_t *from, kmp_yaml *to)
{
    size_t length = from->data.scalar.length;
    yaml_scalar_style_t style = from->data.scalar.style;
    char *text = kmp_arena_alloc(l->arena, length + 1, 1);
    if (!text)
        return;
    /* a zero would hide the text after it: it is replaced by a character that no name or number has */
    for (size_t i = 0; i < length; i++)
        text[i] = from->data.scalar.value[i] ? (char)from->data.scalar.value[i] : '?';
    to->text = text;
    to->empty = style == YAML_PLAIN_SCALAR_STYLE && (length == 0 || strcmp(text, "null") == 0); /* as JSON has it */
    to->text_place.column += style == YAML_SINGLE_QUOTED_SCALAR_STYLE || style == YAML_DOUBLE_QUOTED_SCALAR_STYLE;
}

static void copy_map(loader *l, const yaml_node_t *from, kmp_yaml *to)
{
    to->kind = KMP_YAML_MAP;
    for (const yaml_node_pair_t *pair = from->data.mapping.pairs.start; pair < from->data.mapping.pairs.top; pair++) {
        const yaml_node_t *key = yaml_document_get_node(&l->document, pair->key);
        if (key->type == YAML_SCALAR_NODE)
            kmp_yaml_append(l->arena, to, &l->nodes[pair->key - 1], &l->nodes[pair->value - 1]);
        else
            complain(l, place_of(key->start_mark), "a key must be a name", "");
    }
}

static void check_duplicates(loader *l, const kmp_yaml *map)
{
    size_t size = 4;
    while (size < 2 * (size_t)map->count)
        size *= 2;
    int *slots = KMP_ARENA_NEW(l->arena, int, size);
    for (int i = 0; slots && i < map->count; i++) { /* an entry is the number of a key, from 1 on */
        size_t k = kmp_text_hash(map->keys[i]->text) & (size - 1);
        while (slots[k] && strcmp(map->keys[slots[k] - 1]->text, map->keys[i]->text) != 0)
            k = (k + 1) & (size - 1);
        if (slots[k])
            l->status = kmp_complain(l->context, l->file, map->keys[i]->place.line, map->keys[i]->place.column,
                                     "duplicate key '%s': it is already given in line %d", map->keys[i]->text,
                                     map->keys[slots[k] - 1]->place.line);
        else
            slots[k] = i + 1;
    }
}

static const kmp_yaml *copy_document(loader *l)
{
    const yaml_node_t *from = l->document.nodes.start;
    int count = (int)(l->document.nodes.top - from);
    l->nodes = KMP_ARENA_NEW(l->arena, kmp_yaml, count);
    if (!l->nodes || count == 0)
        return NULL;
    for (int i = 0; i < count; i++) {
        kmp_yaml *to = &l->nodes[i];
        to->place = to->text_place = place_of(from[i].start_mark);
        to->place.file = to->text_place.file = l->number;
        to->text = "";
        if (from[i].type == YAML_SCALAR_NODE)
            copy_scalar(l, &from[i], to);
        else if (from[i].type == YAML_MAPPING_NODE)
            copy_map(l, &from[i], to);
        else {
            to->kind = KMP_YAML_LIST;
            for (const yaml_node_item_t *item = from[i].data.sequence.items.start;
                 item < from[i].data.sequence.items.top; item++)
                kmp_yaml_append(l->arena, to, NULL, &l->nodes[*item - 1]);
        }
    }
    for (int i = 0; i < count; i++)
        if (l->nodes[i].kind == KMP_YAML_MAP) {
            check_duplicates(l, &l->nodes[i]);
            kmp_yaml_index(l->arena, &l->nodes[i]);
        }
    l->nodes->nodes = l->status == KEMPE_OK ? count : 0; /* complaints are repeated: each reading has its own */
    return l->nodes;
}

/* References to nodes of one array, to the same ones of another. */
static const kmp_yaml **moved(kmp_arena *arena, const kmp_yaml **list, int count, const kmp_yaml *from, kmp_yaml *to)
{
    const kmp_yaml **copy = list ? KMP_ARENA_NEW(arena, const kmp_yaml *, count) : NULL;
    for (int k = 0; copy && k < count; k++)
        copy[k] = to + (list[k] - from);
    return copy;
}

const kmp_yaml *kmp_yaml_again(kmp_arena *arena, const kmp_yaml *root, int number)
{
    return kmp_yaml_replace(arena, root, number, NULL, NULL);
}

const kmp_yaml *kmp_yaml_replace(kmp_arena *arena, const kmp_yaml *root, int number, kmp_yaml_other *other, void *user)
{
    kmp_yaml *nodes = KMP_ARENA_NEW(arena, kmp_yaml, root->nodes);
    for (int i = 0; nodes && i < root->nodes; i++) {
        kmp_yaml *to = &nodes[i];
        *to = root[i];
        to->place.file = to->text_place.file = number;
        to->keys = moved(arena, to->keys, to->count, root, nodes);
        to->items = moved(arena, to->items, to->count, root, nodes);
        if (other && to->kind == KMP_YAML_SCALAR)
            *to = *other(user, to);
        if (other) { /* keys may have become others */
            to->slots = NULL;
            to->slot_count = 0;
        }
    }
    return arena->failed ? NULL : nodes;
}

/* Rejects documents that libyaml would need long for. Brackets and anchors in comments count too, which is harmless at
 * these limits. */
static bool check_size(loader *l, const char *text, size_t length)
{
    int depth = 0, anchors = 0;
    for (size_t i = 0; i < length; i++) {
        depth += (text[i] == '[' || text[i] == '{') - (text[i] == ']' || text[i] == '}');
        anchors += text[i] == '&';
        if (depth <= KMP_MOST_BRACKETS && anchors <= KMP_MOST_ANCHORS)
            continue;
        complain(l, place_at(text, length, i),
                 depth > KMP_MOST_BRACKETS ? "the brackets are nested too deeply" : "there are too many anchors '&'",
                 "");
        return false;
    }
    return true;
}

/* -- documents ----------------------------------------------------------------------------------- */

static void check_end(loader *l, yaml_parser_t *parser, const char *text, size_t length)
{
    yaml_document_t next;
    if (!yaml_parser_load(parser, &next)) {
        complain_syntax(l, parser, text, length);
        return;
    }
    const yaml_node_t *root = yaml_document_get_root_node(&next);
    if (root)
        complain(l, place_of(root->start_mark), "a second document begins here: a model is a single document", "");
    yaml_document_delete(&next);
}

kempe_status kmp_yaml_load(kempe_context *context, kmp_arena *arena, const char *file, int number, const char *text,
                           size_t length, const kmp_yaml **root)
{
    loader l = {.context = context, .arena = arena, .file = file, .number = number};
    yaml_parser_t parser;
    *root = NULL;
    if (!check_size(&l, text, length))
        return l.status;
    KMP_TRY(kmp_made(context, yaml_parser_initialize(&parser)));
    yaml_parser_set_input_string(&parser, (const unsigned char *)text, length);
    if (yaml_parser_load(&parser, &l.document)) {
        *root = copy_document(&l);
        bool empty = !yaml_document_get_root_node(&l.document);
        yaml_document_delete(&l.document);
        if (empty)
            complain(&l, (kmp_place){.line = 1, .column = 1}, "the file is empty: a model begins with 'kempe: 1'", "");
        else
            check_end(&l, &parser, text, length);
    } else {
        complain_syntax(&l, &parser, text, length);
    }
    yaml_parser_delete(&parser);
    if (arena->failed)
        l.status = kmp_fail_memory(context);
    return l.status;
}

const kmp_yaml *kmp_yaml_get(const kmp_yaml *map, const char *key)
{
    if (!map || map->kind != KMP_YAML_MAP)
        return NULL;
    int found = kmp_yaml_find(map, key);
    return found < 0 ? NULL : map->items[found];
}

/* A document as text in YAML: mappings by lines, lists of scalars in brackets. */

enum { STEP = 2 };

/* True for a scalar that means the same without quotes, in brackets too. */
static bool is_plain(const char *s)
{
    const char *begin = s[0] == '-' || s[0] == '.' ? s + 1 : s;
    bool plain = isalnum((unsigned char)*begin) || *begin == '_';
    for (; *s; s++)
        plain = plain && (isalnum((unsigned char)*s) || strchr("_.+-*/()^<>=", *s) ||
                          (*s == ' ' && isalnum((unsigned char)s[1])));
    return plain;
}

static void put_scalar(kmp_text *text, const kmp_yaml *node)
{
    const char *s = node->text ? node->text : "";
    if (is_plain(s)) {
        kmp_text_put(text, s);
        return;
    }
    kmp_text_put(text, "\"");
    for (; *s; s++)
        if (*s == '"' || *s == '\\')
            kmp_text_printf(text, "\\%c", *s);
        else if ((unsigned char)*s < 0x20)
            kmp_text_printf(text, "\\x%02X", (unsigned)(unsigned char)*s);
        else
            kmp_text_printf(text, "%c", *s);
    kmp_text_put(text, "\"");
}

/* True for a scalar, and for a list of such. */
static bool is_inline(const kmp_yaml *node)
{
    bool fits = node->kind != KMP_YAML_MAP || node->count == 0;
    for (int k = 0; fits && node->kind == KMP_YAML_LIST && k < node->count; k++)
        fits = is_inline(node->items[k]);
    return fits;
}

static void put_inline(kmp_text *text, const kmp_yaml *node)
{
    if (node->kind == KMP_YAML_SCALAR) {
        put_scalar(text, node);
        return;
    }
    const bool list = node->kind == KMP_YAML_LIST;
    kmp_text_put(text, list ? "[" : "{");
    for (int k = 0; k < node->count; k++) {
        kmp_text_put(text, k > 0 ? ", " : "");
        put_inline(text, node->items[k]);
    }
    kmp_text_put(text, list ? "]" : "}");
}

static void put_block(kmp_text *text, const kmp_yaml *node, int indent);

/* After a key and its colon, or the sign of an item. */
static void put_value(kmp_text *text, const kmp_yaml *node, int indent)
{
    if (node->kind == KMP_YAML_SCALAR && node->empty) {
        kmp_text_put(text, "\n");
    } else if (is_inline(node)) {
        kmp_text_put(text, " ");
        put_inline(text, node);
        kmp_text_put(text, "\n");
    } else {
        kmp_text_put(text, "\n");
        put_block(text, node, indent + STEP);
    }
}

static void put_block(kmp_text *text, const kmp_yaml *node, int indent)
{
    for (int k = 0; k < node->count; k++) {
        kmp_text_printf(text, "%*s", indent, "");
        if (node->kind == KMP_YAML_LIST) {
            kmp_text_put(text, "-");
        } else {
            put_scalar(text, node->keys[k]);
            kmp_text_put(text, ":");
        }
        put_value(text, node->items[k], indent);
    }
}

void kmp_yaml_print(kmp_text *text, const kmp_yaml *root)
{
    if (root->kind == KMP_YAML_MAP && root->count > 0)
        put_block(text, root, 0);
    else
        put_value(text, root, 0);
}
