/* SPDX-License-Identifier: BSD-3-Clause */
/* Expressions as text that reads back to the same tree, with the fewest parentheses. */
#pragma once

#include "model/language/expression.h"

/** Appends the expression as it can be read again, with as few parentheses as keep its tree. */
void kmp_expr_print(kmp_text *text, const kmp_expr *expr, const kmp_expr_names *names);
