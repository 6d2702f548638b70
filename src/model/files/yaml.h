/* SPDX-License-Identifier: BSD-3-Clause */
/* A YAML document as a tree of nodes with their places: a thin layer that hides libyaml. An alias is the node it names;
 * duplicate keys are reported here, once for all mappings. */
#pragma once

#include "base/arena.h"
#include "base/context.h"
#include "base/text.h"
#include "model/data/place.h"
#include <kempe/kempe.h>
#include <stdbool.h>

typedef enum kmp_yaml_kind { KMP_YAML_SCALAR, KMP_YAML_LIST, KMP_YAML_MAP } kmp_yaml_kind;

typedef struct kmp_yaml {
    kmp_yaml_kind kind;
    kmp_place place;
    kmp_place text_place;         /* scalar: of its first character, inside the quotes */
    const char *text;             /* scalar; "" otherwise */
    bool empty;                   /* nothing was written: `key:` */
    int count;                    /* items of a list or a mapping */
    const struct kmp_yaml **keys; /* mapping: scalars */
    const struct kmp_yaml **items;
    int *slots; /* mapping of many keys: their numbers, from 1, by hash; NULL: it has no index */
    size_t slot_count;
    int nodes; /* root of a file in YAML: the number of all nodes, which are one array that it begins; otherwise 0 */
} kmp_yaml;

/** Reads the one document of `text`. `*root` lives in `arena`; it is NULL when no document can be used, and may be set
 * together with KEMPE_E_INPUT. `number` is the file's number in the places of its nodes. */
kempe_status kmp_yaml_load(kempe_context *context, kmp_arena *arena, const char *file, int number, const char *text,
                           size_t length, const kmp_yaml **root);

/** The document of this root once more, with another number in its places; it shares the texts. NULL: no memory. */
const kmp_yaml *kmp_yaml_again(kmp_arena *arena, const kmp_yaml *root, int number);

/** The same, where scalars, keys among them, become the nodes that `other` gives in their place. */
typedef const kmp_yaml *kmp_yaml_other(void *user, const kmp_yaml *node);
const kmp_yaml *kmp_yaml_replace(kmp_arena *arena, const kmp_yaml *root, int number, kmp_yaml_other *other, void *user);

/** Appends a document that can be read again as the same nodes. */
void kmp_yaml_print(kmp_text *text, const kmp_yaml *root);

/** The value of a key, NULL when it is absent or `map` is not a mapping. */
const kmp_yaml *kmp_yaml_get(const kmp_yaml *map, const char *key);
