/* SPDX-License-Identifier: BSD-3-Clause */
/* States and function blocks: their names and motions before any expression is read that may contain them; the laws
 * of states after all that those may contain, the value of a block that is an expression where it is first used. */
#pragma once

#include "model/read/function_block.h"

extern const kmp_block_kind kmp_block_hysteresis;

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

void kmp_read_states(kmp_reader *r); /* but for their rates, which are the last forces */
void kmp_add_state_rates(kmp_reader *r);

/** Reads the block whose value is variable `unknown` of the model, if it is one and has not been read. One that is
 * being read depends on itself, which is an error. */
void kmp_read_block_of(kmp_reader *r, int unknown);
