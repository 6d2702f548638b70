/* SPDX-License-Identifier: BSD-3-Clause */
#include "language_server/key_schema.h"
#include "base/text.h"
#include <string.h>

const kmp_json_value *kmp_schema_read(kmp_arena *arena)
{
    kmp_text all = {0};
    for (int k = 0; kmp_schema_lines[k]; k++)
        kmp_text_put(&all, kmp_schema_lines[k]);
    const size_t length = all.length;
    const char *kept = kmp_text_keep(&all, arena);
    return kept ? kmp_json_read(arena, kept, length) : NULL;
}

/* The definition behind "#/definitions/". */
static const kmp_json_value *definition(const kmp_json_value *whole, const char *reference, const char **kind)
{
    const char *slash = strrchr(reference, '/');
    *kind = slash ? slash + 1 : "";
    return kmp_json_member(kmp_json_member(whole, "definitions"), *kind);
}

/* Adds a schema without its references, of which the first definition is the kind, and its alternatives. */
static void add_schema(kmp_schemas *to, const kmp_json_value *rules, const char *meaning)
{
    const char *kind = "", *reference;
    for (int k = 0; rules && k < KMP_JSON_LEVELS; k++) {
        const char *own = kmp_json_word(rules, "description");
        meaning = *meaning || !own ? meaning : own;
        reference = kmp_json_word(rules, "$ref");
        if (!reference)
            break;
        rules = definition(to->whole, reference, &kind);
    }
    const kmp_json_value *any = kmp_json_member(rules, "anyOf");
    if (rules && (!any || kmp_json_member(rules, "properties")) && to->count < KMP_MOST_SCHEMAS)
        to->one[to->count++] = (kmp_schema){rules, kind, meaning};
    for (int k = 0; any && k < any->count; k++)
        if (!kmp_json_member(any->items[k], "required") || kmp_json_member(any->items[k], "properties"))
            add_schema(to, any->items[k], meaning);
}

kmp_schemas kmp_schema_of_model(const kmp_json_value *whole)
{
    kmp_schemas all = {.whole = whole};
    add_schema(&all, whole, "");
    return all;
}

kmp_schemas kmp_schema_of_key(const kmp_schemas *map, const char *key)
{
    kmp_schemas all = {.whole = map->whole};
    for (int k = 0; k < map->count; k++) {
        const kmp_json_value *rules = map->one[k].rules,
                             *known = kmp_json_member(kmp_json_member(rules, "properties"), key),
                             *more = kmp_json_member(rules, "additionalProperties");
        if (known)
            add_schema(&all, known, "");
        else if (more && more->kind == KMP_JSON_OBJECT)
            add_schema(&all, more, "");
    }
    return all;
}

kmp_schemas kmp_schema_of_item(const kmp_schemas *list)
{
    kmp_schemas all = {.whole = list->whole};
    for (int k = 0; k < list->count; k++) {
        const kmp_json_value *items = kmp_json_member(list->one[k].rules, "items");
        if (items)
            add_schema(&all, items, list->one[k].meaning);
    }
    return all;
}

const char *kmp_schema_key_kind(const kmp_schemas *map)
{
    const char *kind = "";
    for (int k = 0; k < map->count; k++) {
        const char *reference = kmp_json_word(kmp_json_member(map->one[k].rules, "propertyNames"), "$ref");
        if (reference)
            (void)definition(map->whole, reference, &kind);
    }
    return kind;
}

bool kmp_schema_is(const kmp_schemas *node, const char *kind)
{
    for (int k = 0; k < node->count; k++)
        if (strcmp(node->one[k].kind, kind) == 0)
            return true;
    return false;
}
