/* SPDX-License-Identifier: BSD-3-Clause */
/* Search for a node of a document, with what the schema says of it. */
#pragma once

#include "language_server/key_schema.h"
#include "model/files/yaml.h"

typedef struct kmp_found_node {
    const kmp_yaml *node; /* NULL: none was found */
    bool is_key;
    kmp_schemas schemas; /* of the node; of a key, of its mapping */
    const kmp_yaml *map; /* that has the key, or the node as a value; NULL: none */
    const char *key;     /* of the value; "" */
    const char *owner;   /* the body that has it, "ground"; "" */
    int include;         /* the included file that has it; -1 */
} kmp_found_node;

typedef bool kmp_is_wanted(const void *user, const kmp_yaml *node);

/** The first scalar for which `is_wanted` returns true, keys before their values. */
kmp_found_node kmp_node_find(const kmp_json_value *schema, const kmp_yaml *root, kmp_is_wanted *is_wanted,
                             const void *user);

/** The scalar at a byte of the text that the document is made of. */
kmp_found_node kmp_node_at(const kmp_json_value *schema, const kmp_yaml *root, const char *text, size_t offset);
