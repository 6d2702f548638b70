/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/nodes.h"

kmp_node *kmp_node_new(kmp_arena *arena, kmp_node_kind kind, kmp_place place)
{
    kmp_node *node = KMP_ARENA_NEW(arena, kmp_node, 1);
    if (!node)
        return NULL;
    node->kind = kind;
    node->text = "";
    node->place = node->text_place = place;
    return node;
}

kmp_node *kmp_node_word(kmp_arena *arena, kmp_place place, const char *text)
{
    kmp_node *node = kmp_node_new(arena, KMP_NODE_SCALAR, place);
    if (!node)
        return NULL;
    node->text = kmp_arena_strdup(arena, text ? text : "");
    node->empty = !text || !text[0];
    return node->text ? node : NULL;
}

/* Lists and mappings grow by doubling; the count tells when they are full. */
void kmp_node_append(kmp_arena *arena, kmp_node *to, const kmp_node *key, const kmp_node *item)
{
    if (!to || !item)
        return;
    bool full = (to->count & (to->count - 1)) == 0;
    if (full) {
        size_t room = to->count ? 2 * (size_t)to->count : 1;
        const kmp_node **keys = KMP_ARENA_NEW(arena, const kmp_node *, room);
        const kmp_node **items = KMP_ARENA_NEW(arena, const kmp_node *, room);
        if (!keys || !items)
            return;
        for (int i = 0; i < to->count; i++) {
            keys[i] = to->keys ? to->keys[i] : NULL;
            items[i] = to->items[i];
        }
        to->keys = to->kind == KMP_NODE_MAP ? keys : NULL;
        to->items = items;
    }
    if (to->keys)
        to->keys[to->count] = key;
    to->items[to->count++] = item;
}

void kmp_node_put(kmp_arena *arena, kmp_node *map, kmp_place place, const char *key, const kmp_node *item)
{
    const kmp_node *name = kmp_node_word(arena, place, key);
    if (name)
        kmp_node_append(arena, map, name, item);
}
