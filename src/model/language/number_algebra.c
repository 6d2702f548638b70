/* SPDX-License-Identifier: BSD-3-Clause */
/* Sums, products and functions of model numbers: values where all operands are values, expressions if an operand is
 * a parameter. */
#include "model/language/number_algebra.h"
#include <math.h>

static bool is_literal(kmp_number a, double value)
{
    return !a.expr && a.value == value;
}

const kmp_expr *kmp_number_expr(kmp_arena *arena, kmp_number a)
{
    const kmp_expr leaf = {.kind = KMP_EXPR_NUMBER, .value = a.value, .symbol = a.symbol};
    return a.expr ? a.expr : kmp_expr_make(arena, leaf);
}

static kmp_number join(kmp_arena *arena, kmp_expr node, kmp_number a, const kmp_number *b, double value)
{
    if (!a.expr && !(b && b->expr))
        return (kmp_number){.value = value};
    node.a = kmp_number_expr(arena, a);
    node.b = b ? kmp_number_expr(arena, *b) : NULL;
    const bool whole = node.a && (node.b || !b);
    return (kmp_number){.value = value, .expr = whole ? kmp_expr_make(arena, node) : NULL};
}

kmp_number kmp_number_add(kmp_arena *arena, kmp_number a, kmp_number b)
{
    if (is_literal(a, 0) || is_literal(b, 0))
        return is_literal(a, 0) ? b : a;
    return join(arena, (kmp_expr){.kind = KMP_EXPR_ADD}, a, &b, a.value + b.value);
}

kmp_number kmp_number_subtract(kmp_arena *arena, kmp_number a, kmp_number b)
{
    if (is_literal(b, 0))
        return a;
    return join(arena, (kmp_expr){.kind = KMP_EXPR_SUB}, a, &b, a.value - b.value);
}

kmp_number kmp_number_times(kmp_arena *arena, kmp_number a, kmp_number b)
{
    if (is_literal(a, 0) || is_literal(b, 0))
        return (kmp_number){.value = 0};
    if (is_literal(a, 1) || is_literal(b, 1))
        return is_literal(a, 1) ? b : a;
    return join(arena, (kmp_expr){.kind = KMP_EXPR_MUL}, a, &b, a.value * b.value);
}

kmp_number kmp_number_over(kmp_arena *arena, kmp_number a, kmp_number b)
{
    if (is_literal(b, 1))
        return a;
    return join(arena, (kmp_expr){.kind = KMP_EXPR_DIV}, a, &b, a.value / b.value);
}

kmp_number kmp_number_root(kmp_arena *arena, kmp_number a)
{
    return join(arena, (kmp_expr){.kind = KMP_EXPR_CALL, .function = KMP_FUNCTION_sqrt}, a, NULL, sqrt(a.value));
}

kmp_number kmp_number_tanh(kmp_arena *arena, kmp_number a)
{
    return join(arena, (kmp_expr){.kind = KMP_EXPR_CALL, .function = KMP_FUNCTION_tanh}, a, NULL, tanh(a.value));
}

static bool is_same(const kmp_expr *a, const kmp_expr *b)
{
    if (a == b || !a || !b)
        return a == b;
    return a->kind == b->kind && a->function == b->function && a->index == b->index && a->number == b->number &&
           a->value == b->value && a->table == b->table && is_same(a->a, b->a) && is_same(a->b, b->b) &&
           is_same(a->c, b->c);
}

bool kmp_number_is_nothing(kmp_number a)
{
    return a.value == 0 && !a.expr;
}

bool kmp_number_same(kmp_number a, kmp_number b)
{
    return a.value == b.value && is_same(a.expr, b.expr);
}

kmp_number kmp_number_scale(kmp_arena *arena, double factor, kmp_number a)
{
    return kmp_number_times(arena, (kmp_number){.value = factor}, a);
}
