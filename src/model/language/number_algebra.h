/* SPDX-License-Identifier: BSD-3-Clause */
/* Arithmetic with numbers of a model. A result follows the parameters of its operands by an expression in the arena; of
 * operands without one it is a value. Literal zeros and ones leave no operation. */
#pragma once

#include "model/language/expression.h"

/** A number as an operand; a literal keeps its symbol. NULL: no memory. */
const kmp_expr *kmp_number_expr(kmp_arena *arena, kmp_number a);

kmp_number kmp_number_add(kmp_arena *arena, kmp_number a, kmp_number b);
kmp_number kmp_number_subtract(kmp_arena *arena, kmp_number a, kmp_number b);
kmp_number kmp_number_times(kmp_arena *arena, kmp_number a, kmp_number b);
kmp_number kmp_number_over(kmp_arena *arena, kmp_number a, kmp_number b);
kmp_number kmp_number_root(kmp_arena *arena, kmp_number a);

/** factor * a */
kmp_number kmp_number_scale(kmp_arena *arena, double factor, kmp_number a);

kmp_number kmp_number_tanh(kmp_arena *arena, kmp_number a);

/** True for a zero that does not depend on parameters. */
bool kmp_number_is_nothing(kmp_number a);

/** True if both have one value and one expression of parameters, written alike, or none. */
bool kmp_number_same(kmp_number a, kmp_number b);
