/* SPDX-License-Identifier: BSD-3-Clause */
#include "language_server/node_search.h"
#include "language_server/text_places.h"
#include <string.h>

enum { MOST_LEVELS = 40, MOST_VISITS = 2000000 };

typedef struct node_search {
    kmp_is_wanted *is_wanted;
    const void *user;
    const char *keys[3]; /* of the outermost levels; "": an item of a list */
    int items[3];
    int visits;
    kmp_found_node found;
} node_search;

static bool keep(node_search *s, const kmp_yaml *node, const kmp_schemas *schemas, const kmp_yaml *map, const char *key,
                 bool is_key)
{
    if (!s->is_wanted(s->user, node))
        return false;
    const bool body = strcmp(s->keys[0], "bodies") == 0;
    s->found = (kmp_found_node){.node = node,
                                .is_key = is_key,
                                .schemas = *schemas,
                                .map = map,
                                .key = key,
                                .owner = body                                ? s->keys[1]
                                         : strcmp(s->keys[0], "ground") == 0 ? "ground"
                                                                             : "",
                                .include = strcmp(s->keys[0], "include") == 0 ? s->items[1] : -1};
    return true;
}

static bool search(node_search *s, const kmp_yaml *node, const kmp_schemas *schemas, int level)
{
    const bool map = node->kind == KMP_YAML_MAP;
    if (level > MOST_LEVELS || s->visits++ > MOST_VISITS)
        return false;
    for (int k = 0; k < node->count; k++) {
        const kmp_yaml *item = node->items[k];
        const char *key = map ? node->keys[k]->text : "";
        if (level < 3) {
            s->keys[level] = key;
            s->items[level] = k;
            for (int deeper = level + 1; deeper < 3; deeper++)
                s->keys[deeper] = "";
        }
        if (map && keep(s, node->keys[k], schemas, node, "", true))
            return true;
        const kmp_schemas inner = map ? kmp_schema_of_key(schemas, key) : kmp_schema_of_item(schemas);
        if (item->kind == KMP_YAML_SCALAR ? keep(s, item, &inner, map ? node : NULL, key, false)
                                          : search(s, item, &inner, level + 1))
            return true;
    }
    return false;
}

kmp_found_node kmp_node_find(const kmp_json_value *schema, const kmp_yaml *root, kmp_is_wanted *is_wanted,
                             const void *user)
{
    node_search s = {.is_wanted = is_wanted, .user = user, .keys = {"", "", ""}, .found.include = -1};
    const kmp_schemas schemas = kmp_schema_of_model(schema);
    if (root && root->kind == KMP_YAML_SCALAR)
        (void)keep(&s, root, &schemas, NULL, "", false);
    else if (root)
        (void)search(&s, root, &schemas, 0);
    return s.found;
}

/* True where a scalar begins in a line at or before a character and ends behind it. */
static bool holds(const void *user, const kmp_yaml *node)
{
    const kmp_place *place = user;
    const int end = node->text_place.column + (int)strlen(node->text);
    return node->place.line == place->line && node->text_place.column <= place->column && place->column <= end;
}

kmp_found_node kmp_node_at(const kmp_json_value *schema, const kmp_yaml *root, const char *text, size_t offset)
{
    kmp_place place = {.line = (int)kmp_position_of(text, offset, false).line + 1, .column = 1};
    for (size_t k = kmp_line_begin(text, offset); k < offset; k++)
        place.column += ((unsigned char)text[k] & 0xC0) != 0x80;
    return kmp_node_find(schema, root, holds, &place);
}
