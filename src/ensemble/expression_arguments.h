/* SPDX-License-Identifier: BSD-3-Clause */
/* Functions of an expression that may change between points at which they are sampled, however smooth what they are
 * taken of is: sin(1000 q), exp(-(q/w)^2), max(0, 1 - abs(q)/w), a table of many points. */
#pragma once

#include "model/language/expression.h"

/** Lists the functions of an expression that are no polynomials. false: no memory. */
bool kmp_expr_arguments(kmp_arena *arena, const kmp_expr *expr, const kmp_expr_argument **list);
