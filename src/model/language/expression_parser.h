/* SPDX-License-Identifier: BSD-3-Clause */
/* The parser of expressions: functions for its parts. expression.c has the rules of the grammar,
 * expression_references.c the rules of words that refer to other parts of the model. Errors are NULL. */
#pragma once

#include "base/clones.h"
#include "model/language/expression.h"

typedef struct kmp_parser {
    const kmp_expr_scope *scope;
    const char *text, *at;
    int depth, nodes;
} kmp_parser;
