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

/* Lists and mappings grow by doubling; the count shows when they are full. */
void kmp_yaml_append(kmp_arena *arena, kmp_yaml *to, const kmp_yaml *key, const kmp_yaml *item)
{
    if (!to || !item)
        return;
    bool full = (to->count & (to->count - 1)) == 0;
    if (full) {
        size_t room = to->count ? 2 * (size_t)to->count : 1;
        const kmp_yaml **keys = KMP_ARENA_NEW(arena, const kmp_yaml *, room);
        const kmp_yaml **items = KMP_ARENA_NEW(arena, const kmp_yaml *, room);
        if (!keys || !items)
            return;
        for (int i = 0; i < to->count; i++) {
            keys[i] = to->keys ? to->keys[i] : NULL;
            items[i] = to->items[i];
        }
        to->keys = to->kind == KMP_YAML_MAP ? keys : NULL;
        to->items = items;
    }
    if (to->keys)
        to->keys[to->count] = key;
    to->items[to->count++] = item;
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
