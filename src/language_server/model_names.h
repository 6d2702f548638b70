/* SPDX-License-Identifier: BSD-3-Clause */
/* The names of a model file: where each is declared, also in the files that it includes, and where the file uses them.
 * Places are from the nodes of YAML, kinds of values from the schema, words as in the parser of expressions. */
#pragma once

#include "language_server/key_schema.h"
#include "model/files/yaml.h"

/** The text of a file with its document; no document: root is NULL. */
typedef struct kmp_text_source {
    const char *path, *text;
    const kmp_yaml *root;
} kmp_text_source;

typedef enum kmp_name_kind {
#define KMP_NAME_KIND(kind, ...) KMP_NAME_##kind,
#include "language_server/name_kinds.def"
#undef KMP_NAME_KIND
    KMP_NAME_KINDS
} kmp_name_kind;

typedef struct kmp_name_row {
    const char *section, *word;
    int symbol;
} kmp_name_row;
extern const kmp_name_row kmp_name_rows[];

/** A set of kinds; expressions have another way to look names up. */
typedef unsigned kmp_name_set;
#define KMP_NAMES_IN(kind)      (1U << KMP_NAME_##kind)
#define KMP_NAMES_OF_EXPRESSION (1U << 31)
#define KMP_NAMES_ALL           ((1U << KMP_NAME_KINDS) - 1)
/** Names of values in an expression, and of functions. */
#define KMP_NAMES_OF_VALUES                                                                                            \
    (KMP_NAMES_IN(PARAMETER) | KMP_NAMES_IN(INPUT) | KMP_NAMES_IN(STATE) | KMP_NAMES_IN(UNKNOWN) |                     \
     KMP_NAMES_IN(TABLE) | KMP_NAMES_IN(SENSOR))

typedef struct kmp_declared {
    kmp_name_kind kind;
    const char *name;              /* with the prefixes of included files */
    const char *owner;             /* body of a point, an interface; "" */
    const kmp_text_source *source; /* where it is declared */
    kmp_place place;               /* of the name there */
    const kmp_yaml *node;          /* what is declared; NULL: only a word */
    int prefix;                    /* bytes of the name that are prefixes */
    int include;                   /* index among the included files of the model; -1: it is its own */
    bool implied;                  /* the name of a joint that is the one of its body */
    int next;                      /* with the same hash; -1: none */
} kmp_declared;

/** A use of a name in the file: bytes of its text; the number of the declared one. */
typedef struct kmp_name_use {
    size_t begin, end;
    int declared;
} kmp_name_use;

typedef struct kmp_model_names {
    kmp_arena arena;
    const kmp_text_source *source;
    kmp_declared *declared;
    int count, heads[256];
    kmp_name_use *uses;
    int use_count;
} kmp_model_names;

/** A file that another one includes by this name; NULL: it cannot be read. */
typedef const kmp_text_source *kmp_source_beside(void *user, const kmp_text_source *from, const char *name);

/** Fills `names`, which kmp_names_free empties. Without memory the arena has failed. */
void kmp_names_find(kmp_model_names *names, const kmp_json_value *schema, const kmp_text_source *source,
                    kmp_source_beside *beside, void *user);
void kmp_names_free(kmp_model_names *names);

/** The use that has this byte, or ends at it; NULL: there is none. */
const kmp_name_use *kmp_names_at(const kmp_model_names *names, size_t offset);

/** The kinds of names that the arguments of a function or of an output may be: of expressions, where they are numbers.
 */
kmp_name_set kmp_names_of_call(const char *word, size_t length);

/** The kinds that a value of a kind of the schema may be; 0: it is not a name. */
kmp_name_set kmp_names_of_value(const char *kind);

/** The end of the units behind a number of an expression; `k` where there are none. */
size_t kmp_units_end(const char *text, size_t k);
