/* SPDX-License-Identifier: BSD-3-Clause */
/* Documents written by Kempe itself instead of by a user: what builds a model in code or reads another format writes
 * the nodes that a YAML file would have had, so that the reader is the only judge. Without memory they do nothing;
 * the arena remembers. */
#ifndef KMP_MODEL_FILES_NODES_H
#define KMP_MODEL_FILES_NODES_H

#include "model/files/yaml.h"

/** An empty list or mapping. */
kmp_yaml *kmp_yaml_new(kmp_arena *arena, kmp_yaml_kind kind, kmp_place place);

/** A scalar; NULL and "" are nothing. */
kmp_yaml *kmp_yaml_word(kmp_arena *arena, kmp_place place, const char *text);

/** Adds an item to a list, or with a key to a mapping. NULL items are passed over. */
void kmp_yaml_append(kmp_arena *arena, kmp_yaml *to, const kmp_yaml *key, const kmp_yaml *item);
void kmp_yaml_put(kmp_arena *arena, kmp_yaml *map, kmp_place place, const char *key, const kmp_yaml *item);

#endif
