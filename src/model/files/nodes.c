/* SPDX-License-Identifier: BSD-3-Clause */
/* Documents in memory: mappings keep their order, and mappings with many keys get an index by hash. */
#include "model/files/nodes.h"
#include <string.h>

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

/* Mappings of this number of keys have an index. */
enum { INDEXED_FROM = 32 };

/* The slot of a key, or where it belongs. A mapping may share its slots with one that has more keys. */
static size_t slot_of(const kmp_yaml *map, const char *key)
{
    size_t at = kmp_text_hash(key) & (map->slot_count - 1);
    for (; map->slots[at]; at = (at + 1) & (map->slot_count - 1)) {
        const kmp_yaml *own = map->slots[at] <= map->count ? map->keys[map->slots[at] - 1] : NULL;
        if (own && own->text && strcmp(own->text, key) == 0)
            break;
    }
    return at;
}

void kmp_yaml_index(kmp_arena *arena, kmp_yaml *map)
{
    int first = map->count - 1;
    if (map->kind != KMP_YAML_MAP || map->count < INDEXED_FROM)
        return;
    const kmp_yaml *begins = map->keys[0], *ends = map->keys[first];
    if (!begins || !ends || !begins->text || !ends->text)
        return;
    if (2 * (size_t)map->count > map->slot_count) {
        map->slot_count = 4 * (size_t)map->count;
        while (map->slot_count & (map->slot_count - 1))
            map->slot_count &= map->slot_count - 1;
        map->slots = KMP_ARENA_NEW(arena, int, map->slot_count);
        first = 0;
    }
    for (int k = first; map->slots && k < map->count; k++) {
        if (!map->keys[k]->text) {
            map->slots = NULL;
            map->slot_count = 0;
            return;
        }
        size_t at = slot_of(map, map->keys[k]->text);
        map->slots[at] = map->slots[at] ? map->slots[at] : k + 1;
    }
}

int kmp_yaml_find(const kmp_yaml *map, const char *key)
{
    if (map->slots)
        return map->slots[slot_of(map, key)] - 1;
    for (int i = 0; i < map->count; i++)
        if (strcmp(map->keys[i]->text, key) == 0)
            return i;
    return -1;
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
    if (keys)
        kmp_yaml_index(arena, to);
}

void kmp_yaml_put(kmp_arena *arena, kmp_yaml *map, kmp_place place, const char *key, const kmp_yaml *item)
{
    const kmp_yaml *name = kmp_yaml_word(arena, place, key);
    if (name)
        kmp_yaml_append(arena, map, name, item);
}

void kmp_yaml_put_word(kmp_arena *arena, kmp_yaml *map, kmp_place place, const char *key, const char *text)
{
    if (text)
        kmp_yaml_put(arena, map, place, key, kmp_yaml_word(arena, place, text));
}

void kmp_yaml_set(kmp_arena *arena, kmp_yaml *map, const char *key, const kmp_yaml *item)
{
    const int at = map && item ? kmp_yaml_find(map, key) : -1;
    if (at >= 0)
        map->items[at] = item;
    else if (item)
        kmp_yaml_put(arena, map, item->place, key, item);
}

const kmp_yaml *kmp_yaml_with(kmp_arena *arena, const kmp_yaml *map, const char *key, const kmp_yaml *item)
{
    kmp_yaml *changed = item ? kmp_yaml_copy(arena, map) : NULL;
    kmp_yaml_set(arena, changed, key, item);
    return changed ? changed : map;
}

kmp_yaml *kmp_yaml_open(kmp_arena *arena, kmp_yaml *map, const char *key)
{
    const kmp_yaml *own = kmp_yaml_get(map, key);
    kmp_yaml *open =
        own && own->kind == KMP_YAML_MAP ? kmp_yaml_copy(arena, own) : kmp_yaml_new(arena, KMP_YAML_MAP, map->place);
    kmp_yaml_set(arena, map, key, open);
    return open;
}

const kmp_yaml *kmp_yaml_friction(kmp_arena *arena, kmp_place place, const char *sliding, const char *const level[2])
{
    kmp_yaml *levels = kmp_yaml_new(arena, KMP_YAML_LIST, place), *friction = kmp_yaml_new(arena, KMP_YAML_MAP, place);
    kmp_yaml *entry = kmp_yaml_new(arena, KMP_YAML_MAP, place);
    for (int k = 0; k < 2; k++)
        kmp_yaml_append(arena, levels, NULL, kmp_yaml_word(arena, place, level[k]));
    kmp_yaml_put(arena, friction, place, "force", levels);
    kmp_yaml_put_word(arena, entry, place, "sliding", sliding);
    kmp_yaml_put(arena, entry, place, "friction", friction);
    return entry;
}

kmp_yaml *kmp_yaml_copy(kmp_arena *arena, const kmp_yaml *from)
{
    kmp_yaml *copy = kmp_yaml_new(arena, from->kind, from->place);
    for (int i = 0; i < from->count; i++)
        kmp_yaml_append(arena, copy, from->keys ? from->keys[i] : NULL, from->items[i]);
    return copy;
}
