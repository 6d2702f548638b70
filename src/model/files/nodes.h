/* SPDX-License-Identifier: BSD-3-Clause */
/* Documents written by Kempe itself instead of by a user. Functions that build a model in code or read another format
 * write the nodes that a YAML file would have had, so that all checks are the reader's. Without memory they do nothing;
 * the arena remembers the failure. */
#pragma once

#include "model/files/yaml.h"

/** An empty list or mapping. */
kmp_yaml *kmp_yaml_new(kmp_arena *arena, kmp_yaml_kind kind, kmp_place place);

/** A list or mapping of the same items, to be changed. */
kmp_yaml *kmp_yaml_copy(kmp_arena *arena, const kmp_yaml *from);

/** A scalar; NULL and "" are nothing. */
kmp_yaml *kmp_yaml_word(kmp_arena *arena, kmp_place place, const char *text);

/** Takes the last key of a large mapping up in its index, or makes that. Without memory, and while keys have no texts,
 * there is none. */
void kmp_yaml_index(kmp_arena *arena, kmp_yaml *map);

/** Adds an item to a list, or with a key to a mapping. NULL items are passed over. */
void kmp_yaml_append(kmp_arena *arena, kmp_yaml *to, const kmp_yaml *key, const kmp_yaml *item);
void kmp_yaml_put(kmp_arena *arena, kmp_yaml *map, kmp_place place, const char *key, const kmp_yaml *item);

/** Adds a word; NULL is passed over. */
void kmp_yaml_put_word(kmp_arena *arena, kmp_yaml *map, kmp_place place, const char *key, const char *text);

/** Puts an item in place of the item of a key, or adds it. NULL items are passed over. */
void kmp_yaml_set(kmp_arena *arena, kmp_yaml *map, const char *key, const kmp_yaml *item);

/** A copy of the mapping with another item of a key; the mapping itself where the item is NULL, and without memory. */
const kmp_yaml *kmp_yaml_with(kmp_arena *arena, const kmp_yaml *map, const char *key, const kmp_yaml *item);

/** A copy of the mapping of a key, in its place; an empty one where there is none. NULL: no memory. */
kmp_yaml *kmp_yaml_open(kmp_arena *arena, kmp_yaml *map, const char *key);

/** An entry of `forces` that is friction on a rate, with a level against each of its directions. */
const kmp_yaml *kmp_yaml_friction(kmp_arena *arena, kmp_place place, const char *sliding, const char *const level[2]);

/** The number of a key; -1: it is absent. */
int kmp_yaml_find(const kmp_yaml *map, const char *key);
