/* SPDX-License-Identifier: BSD-3-Clause */
/* Functions of the expression language: those with an operation of their own, and those that others are made of. */
#pragma once

#include "model/language/expression_parser.h"

const char *kmp_function_name(kmp_function function);

/** Its word, "" if it is not said. */
const char *kmp_outside_word(kmp_outside outside);

/** An expression from a text of the program's own, which knows only the names in `locals`; NULL: no memory. */
const kmp_expr *kmp_expr_formula(kmp_arena *arena, const char *text, const kmp_expr_locals *locals);

/** True for the name of a function; and its call, from the opening parenthesis on. */
bool kmp_parse_is_function(const char *name);
const kmp_expr *kmp_parse_call(kmp_parser *p, const char *where, const char *name);
