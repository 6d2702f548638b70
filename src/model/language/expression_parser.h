/* SPDX-License-Identifier: BSD-3-Clause */
/* The parser of expressions: functions for its parts. expression.c has the rules of the grammar,
 * expression_references.c those of words that refer to other parts of the model. Errors are NULL. */
#pragma once

#include "base/clones.h"
#include "model/language/expression.h"

typedef struct kmp_parser {
    const kmp_expr_scope *scope;
    const char *text, *at;
    int depth, nodes;
} kmp_parser;

/** Skips space, and the character c if it follows; false: it does not. */
void kmp_parse_skip_space(kmp_parser *p);
bool kmp_parse_take(kmp_parser *p, char c);

/** The length of the name at s, 0 when there is none, and a copy of the n characters at p->at, which are passed. */
size_t kmp_parse_word_length(const char *s);
const char *kmp_parse_copy(kmp_parser *p, size_t n);

/** The column of a place in the text. */
int kmp_parse_column(const kmp_parser *p, const char *where);

/** Errors at a place: any sentence; the grammar requires `wanted` at p->at; a name is unknown. */
const kmp_expr *kmp_parse_complain(const kmp_parser *p, const char *where, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
const kmp_expr *kmp_parse_wanted(kmp_parser *p, const char *wanted);
const kmp_expr *kmp_parse_unknown_name(const kmp_parser *p, const char *where, const char *name,
                                       kmp_expr_symbol symbol);

/** Reports a sentence at a place, and frees it. */
const kmp_expr *kmp_parse_say(const kmp_parser *p, const char *where, kmp_text *sentence);

/** "a function of t": the operands that are allowed, for messages. */
const char *kmp_parse_allowed(const kmp_expr_scope *scope);

/** A node whose column is that of `where`. */
const kmp_expr *kmp_parse_make(kmp_parser *p, const char *where, kmp_expr expr);

/** The rules `sum` and `sum compare sum`. */
const kmp_expr *kmp_parse_sum(kmp_parser *p);
const kmp_expr *kmp_parse_comparison(kmp_parser *p);

/** True for the name of a function; and its call, from the opening parenthesis on. */
bool kmp_parse_is_function(const char *name);
const kmp_expr *kmp_parse_call(kmp_parser *p, const char *where, const char *name);

/** q(NAME) and qd(NAME), from the opening parenthesis on. */
const kmp_expr *kmp_parse_coordinate(kmp_parser *p, const char *where, kmp_expr_kind kind);

/** True if NAME(..) refers to other parts of the model: lambda, rate, measures; and that reference, from the opening
 * parenthesis on. */
bool kmp_parse_refers(const char *name);
const kmp_expr *kmp_parse_reference(kmp_parser *p, const char *where, const char *name);
