/* SPDX-License-Identifier: BSD-3-Clause */
/* Function blocks: an entry of `states`, which has one state or several, and may have a value that is no state but an
 * expression of them. The names are known before any expression is read, what they mean is read when it is needed. */
#pragma once

#include "model/read/reading.h"

typedef struct kmp_function_block kmp_function_block;

/** A kind of entry: a row of read_states.c. */
typedef struct kmp_block_kind {
    const char *key;  /* the key that only it has */
    const char *keys; /* the others, beside `start` and `scale`, with a space around each */
    int (*count)(kmp_reader *r, kmp_function_block *b);            /* its states; sets b->direct */
    const char *(*suffix)(const kmp_function_block *b, int state); /* of the name of a state that is not its value */
    void (*read)(kmp_reader *r, kmp_function_block *b); /* sets rates and next values, and the value if it is direct */
} kmp_block_kind;

struct kmp_function_block {
    const kmp_yaml *map;
    const char *name, *what;
    kmp_place place;
    const kmp_block_kind *kind; /* NULL after an error */
    int first, count;           /* its states */
    bool direct; /* its value is an expression of the model, `output` among them; otherwise its first state */
    int output;
    bool sampled;
    int signal;            /* of a continuous delay: the input of its rate */
    const kmp_expr **rate; /* of its states */
    enum { KMP_BLOCK_WAITS, KMP_BLOCK_BEGUN, KMP_BLOCK_READ } progress;
};
