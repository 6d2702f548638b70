/* SPDX-License-Identifier: BSD-3-Clause */
/* Values of JSON (RFC 8259), read into an arena. */
#pragma once

#include "base/arena.h"
#include <stdbool.h>

typedef enum kmp_json_kind {
    KMP_JSON_NULL,
    KMP_JSON_BOOLEAN,
    KMP_JSON_NUMBER,
    KMP_JSON_STRING,
    KMP_JSON_ARRAY,
    KMP_JSON_OBJECT
} kmp_json_kind;

typedef struct kmp_json_value {
    kmp_json_kind kind;
    const char *text; /* of a string, a number, true or false as written; otherwise "" */
    bool replaced;    /* of a string: it has half of a surrogate pair or a zero, for which `text` has U+FFFD */
    int count;        /* of an array or an object */
    const char **keys;
    const struct kmp_json_value **items;
} kmp_json_value;

/** Values nest this deep at most. */
enum { KMP_JSON_LEVELS = 64 };

/** The value that `length` bytes are. NULL: they are not JSON in UTF-8, nest too deeply, or there is no memory, where
 * the arena has failed. */
const kmp_json_value *kmp_json_read(kmp_arena *arena, const char *text, size_t length);

/** A member of an object; NULL: it has none of this name, or is NULL or no object. */
const kmp_json_value *kmp_json_member(const kmp_json_value *object, const char *key);

/** The text of a member that is a string; NULL: there is none. */
const char *kmp_json_word(const kmp_json_value *object, const char *key);

/** A member that is a whole number from 0 on; -1: there is none. */
long kmp_json_count(const kmp_json_value *object, const char *key);
