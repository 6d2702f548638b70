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

/** The kinds with files of their own. */
extern const kmp_block_kind kmp_block_transfer, kmp_block_pid, kmp_block_hysteresis, kmp_block_delay;

/** The value of state i of a block. */
const kmp_expr *kmp_block_state(kmp_reader *r, const kmp_function_block *b, int i);

/** An expression by a text with names of locals; NULL: no memory, or a local that is used is missing. */
const kmp_expr *kmp_block_formula(kmp_reader *r, const char *text, const kmp_expr_locals *locals);

/** Adds a name to the locals; nothing where `expr` is NULL. */
void kmp_block_local(kmp_expr_locals *locals, const char *name, const kmp_expr *expr);

/** A number as an expression. */
const kmp_expr *kmp_block_number(kmp_reader *r, const kmp_number *x);

/** Reads the number of a key; NULL when it is absent or wrong. `*value`: its value, if there is one. */
const kmp_expr *kmp_block_key(kmp_reader *r, const kmp_function_block *b, const char *key, double *value);

/** The input of a block, under the key of its kind; NULL after an error. It contains no multipliers where `direct`. */
const kmp_expr *kmp_block_input(kmp_reader *r, const kmp_function_block *b);

/** The time between samples of a sampled block, as an expression. */
const kmp_expr *kmp_block_period(kmp_reader *r, const kmp_function_block *b);

/** Gives state i its law: the next value of a sampled block, or its rate. */
void kmp_block_law(kmp_reader *r, kmp_function_block *b, int i, const kmp_expr *law);

/** Gives a direct block its value. */
void kmp_block_value(kmp_reader *r, const kmp_function_block *b, const kmp_expr *value);

/** A list of two numbers; false when absent or wrong. */
bool kmp_block_two(kmp_reader *r, const kmp_function_block *b, const char *key, kmp_number two[2]);
