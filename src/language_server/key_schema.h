/* SPDX-License-Identifier: BSD-3-Clause */
/* The content of model files by their JSON Schema (schema/kempe.schema.json), which is made from the tables of
 * keys of the reader, is part of the library. */
#pragma once

#include "language_server/json_value.h"

/** Lines of the schema; NULL ends them. Written by CMake. */
extern const char *const kmp_schema_lines[];

/** One of the things that a node may be. */
typedef struct kmp_schema {
    const kmp_json_value *rules; /* without references and alternatives */
    const char *kind;            /* of its definition, as "number" or "point_name"; "" */
    const char *meaning;         /* of the key; "" */
} kmp_schema;

enum { KMP_MOST_SCHEMAS = 16 };

/** All of them. */
typedef struct kmp_schemas {
    const kmp_json_value *whole;
    int count;
    kmp_schema one[KMP_MOST_SCHEMAS];
} kmp_schemas;

/** The schema in an arena; NULL: no memory. */
const kmp_json_value *kmp_schema_read(kmp_arena *arena);

/** The schemas of the document, of the value of a key, of an item of a list. */
kmp_schemas kmp_schema_of_model(const kmp_json_value *whole);
kmp_schemas kmp_schema_of_key(const kmp_schemas *map, const char *key);
kmp_schemas kmp_schema_of_item(const kmp_schemas *list);

/** The kind of names that are keys of a mapping; "": its keys are words of the language or new names. */
const char *kmp_schema_key_kind(const kmp_schemas *map);

/** True if one of them is of this kind. */
bool kmp_schema_is(const kmp_schemas *node, const char *kind);
