/* SPDX-License-Identifier: BSD-3-Clause */
/* The outline of a file: its sections, their entries, points of bodies. */
#include "language_server/session.h"
#include <string.h>

enum { SECTION_SYMBOL = 3, POINT_SYMBOL = 8, MOST_ENDS = 100 };

/* The last line of what a node has: of its last scalar. */
static kmp_place end_of(const kmp_yaml *node)
{
    for (int k = 0; k < MOST_ENDS && node->kind != KMP_YAML_SCALAR && node->count > 0; k++)
        node = node->items[node->count - 1];
    kmp_place end = node->place;
    end.column += node->kind == KMP_YAML_SCALAR ? (int)strlen(node->text) : 0;
    return end;
}

/* Begins a symbol, whose children follow. */
static void begin_symbol(kempe_language_server *s, kmp_json *json, const kmp_text_source *source, const kmp_yaml *key,
                         const kmp_yaml *node, int symbol)
{
    const size_t begin = kmp_offset_of_place(source->text, key->text_place), word = begin + strlen(key->text);
    const size_t end = kmp_offset_of_place(source->text, end_of(node));
    kmp_json_object(json, NULL);
    kmp_json_put(json, "name %s kind %d", key->text[0] ? key->text : "~", symbol);
    kmp_put_range(s, json, "range", source->text, begin, end > word ? end : word);
    kmp_put_range(s, json, "selectionRange", source->text, begin, word);
    kmp_json_array(json, "children");
}

static void end_symbol(kmp_json *json)
{
    kmp_json_end(json);
    kmp_json_end(json);
}

static int symbol_of_section(const char *section)
{
    for (int kind = 0; kind < KMP_NAME_KINDS; kind++)
        if (strcmp(kmp_name_rows[kind].section, section) == 0)
            return kmp_name_rows[kind].symbol;
    return POINT_SYMBOL;
}

static void put_entries(kempe_language_server *s, kmp_json *json, const kmp_text_source *source, const kmp_yaml *map,
                        int symbol, bool with_points)
{
    for (int k = 0; map && map->kind == KMP_YAML_MAP && k < map->count; k++) {
        begin_symbol(s, json, source, map->keys[k], map->items[k], symbol);
        if (with_points)
            put_entries(s, json, source, kmp_yaml_get(map->items[k], "points"), POINT_SYMBOL, false);
        end_symbol(json);
    }
}

void kmp_answer_symbols(kempe_language_server *s, kmp_open_file *file, kmp_reply *answer)
{
    const kmp_text_source *source = &file->good;
    const kmp_yaml *root = file->is_good && source->root->kind == KMP_YAML_MAP ? source->root : NULL;
    kmp_json_array(&answer->json, NULL);
    for (int k = 0; root && k < root->count; k++) {
        const char *section = root->keys[k]->text;
        begin_symbol(s, &answer->json, source, root->keys[k], root->items[k], SECTION_SYMBOL);
        put_entries(s, &answer->json, source, root->items[k], symbol_of_section(section),
                    strcmp(section, "bodies") == 0);
        end_symbol(&answer->json);
    }
    kmp_json_end(&answer->json);
}
