/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/files/nodes.h"

kmp_yaml *kmp_yaml_new(kmp_arena *arena, kmp_yaml_kind kind, kmp_place place)
{
    kmp_yaml *node = KMP_ARENA_NEW(arena, kmp_yaml, 1);
    if (!node)
        return NULL;
    node->kind = kind;
    node->text = "";
    node->place = node->text_place = place;
    return node;
}

kmp_yaml *kmp_yaml_word(kmp_arena *arena, kmp_place place, const char *text)
{
    kmp_yaml *node = kmp_yaml_new(arena, KMP_YAML_SCALAR, place);
    if (!node)
        return NULL;
    node->text = kmp_arena_strdup(arena, text ? text : "");
    node->empty = !text || !text[0];
    return node->text ? node : NULL;
}

void kmp_yaml_append(kmp_arena *arena, kmp_yaml *to, const kmp_yaml *key, const kmp_yaml *item)
{
    if (!to || !item)
        return;
    const kmp_yaml **keys = NULL, **items = kmp_arena_room(arena, to->items, to->count, sizeof *items);
    if (to->kind == KMP_YAML_MAP)
        keys = kmp_arena_room(arena, to->keys, to->count, sizeof *keys);
    if (!items || (!keys && to->kind == KMP_YAML_MAP))
        return;
    to->keys = keys;
    to->items = items;
    if (keys)
        keys[to->count] = key;
    items[to->count++] = item;
}

void kmp_yaml_put(kmp_arena *arena, kmp_yaml *map, kmp_place place, const char *key, const kmp_yaml *item)
{
    const kmp_yaml *name = kmp_yaml_word(arena, place, key);
    if (name)
        kmp_yaml_append(arena, map, name, item);
}

kmp_yaml *kmp_yaml_copy(kmp_arena *arena, const kmp_yaml *from)
{
    kmp_yaml *copy = kmp_yaml_new(arena, from->kind, from->place);
    for (int i = 0; i < from->count; i++)
        kmp_yaml_append(arena, copy, from->keys ? from->keys[i] : NULL, from->items[i]);
    return copy;
}
