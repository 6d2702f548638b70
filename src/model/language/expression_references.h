/* SPDX-License-Identifier: BSD-3-Clause */
/* Words that refer to other parts of the model: coordinates, multipliers, points and their axes. */
#pragma once

#include "model/language/expression_parser.h"

/** The words of measures, by kind. */
extern const kmp_name_list kmp_measure_words;

/** A measure without components, or the rate of an expression, as if they were written; NULL: no memory. */
const kmp_expr *kmp_expr_measure(kmp_arena *arena, kmp_measure_kind kind, int count,
                                 const kmp_measure_argument *argument);
const kmp_expr *kmp_expr_rate(kmp_arena *arena, const kmp_expr *of);

/** The first operand that depends on accelerations; NULL when there is none. */
const kmp_expr *kmp_expr_acceleration(const kmp_expr *expr);

/** A test for kmp_expr_find: an operand that depends on rates. */
bool kmp_expr_is_rate(const kmp_expr *expr, const void *unused);

/** "a function of t": the operands that are allowed, for messages. */
const char *kmp_parse_allowed(const kmp_expr_scope *scope);

/** q(NAME) and qd(NAME), from the opening parenthesis on. */
const kmp_expr *kmp_parse_coordinate(kmp_parser *p, const char *where, kmp_expr_kind kind);

/** True if NAME(..) refers to other parts of the model: lambda, rate, measures; and that reference, from the opening
 * parenthesis on. */
bool kmp_parse_refers(const kmp_parser *p, const char *name);
const kmp_expr *kmp_parse_reference(kmp_parser *p, const char *where, const char *name);
