/* SPDX-License-Identifier: BSD-3-Clause */
/* Functions of an expression that may change between points at which they are sampled, however smooth what they are
 * taken of is: sin(1000 q), exp(-(q/w)^2), max(0, 1 - abs(q)/w), a table of many points. Each is listed with its
 * argument, in a unit in which the function is smooth over 1. */
#include "ensemble/expression_arguments.h"
#include "base/clones.h"
#include "model/language/expression.h"
#include "model/language/expression_value.h"
#include "symbolic/table_function.h"
#include <math.h>

typedef struct listing {
    kmp_arena *arena;
    kmp_expr_argument *first;
    bool failed;
} listing;

KMP_NOINLINE static const kmp_expr *node(listing *l, kmp_expr e)
{
    kmp_expr *made = KMP_ARENA_NEW(l->arena, kmp_expr, 1);
    l->failed = l->failed || !made;
    if (made)
        *made = e;
    return made;
}

static const kmp_expr *call(listing *l, kmp_function function, const kmp_expr *a)
{
    return node(l, (kmp_expr){.kind = KMP_EXPR_CALL, .function = function, .a = a});
}

static const kmp_expr *of_two(listing *l, kmp_expr_kind kind, const kmp_expr *a, const kmp_expr *b)
{
    return node(l, (kmp_expr){.kind = kind, .a = a, .b = b});
}

static const kmp_expr *times(listing *l, double factor, const kmp_expr *a)
{
    return of_two(l, KMP_EXPR_MUL, node(l, (kmp_expr){.kind = KMP_EXPR_NUMBER, .value = factor}), a);
}

static void add(listing *l, const kmp_expr *in, kmp_argument_kind kind, const kmp_expr *argument)
{
    kmp_expr_argument *made = KMP_ARENA_NEW(l->arena, kmp_expr_argument, 1);
    l->failed = l->failed || !made || !argument;
    if (!made)
        return;
    *made = (kmp_expr_argument){.kind = kind, .of = argument, .in = in, .next = l->first};
    l->first = made;
}

/* log |a|: of a quotient and a power the size is exp of a multiple of it. */
static const kmp_expr *log_of(listing *l, const kmp_expr *a)
{
    return call(l, KMP_FUNCTION_log, call(l, KMP_FUNCTION_abs, a));
}

/* Low powers are smooth, and a root is smooth but where it is zero. */
KMP_NOINLINE static void add_power(listing *l, const kmp_expr *e)
{
    const double n = e->b->kind == KMP_EXPR_NUMBER ? e->b->value : NAN;
    if (n != 0.5 && n != 1 && n != 2 && n != 3)
        add(l, e, KMP_ARGUMENT_PEAK, of_two(l, KMP_EXPR_MUL, e->b, log_of(l, e->a)));
}

KMP_NOINLINE static void add_table(listing *l, const kmp_expr *e)
{
    const kmp_named_table *t = e->table;
    const kmp_expr *const argument[] = {e->a, e->b};
    for (int k = 0; k < (t->of_two ? 2 : 1); k++) {
        int count = t->of_two ? t->surface->count[k] : t->table->count;
        const double *x = t->of_two ? t->surface->knot[k] : t->table->x;
        if (count > 1 && !kmp_expr_is_constant(argument[k]))
            add(l, e, KMP_ARGUMENT_WAVE, times(l, (count - 1) / (x[count - 1] - x[0]), argument[k]));
    }
}

KMP_NOINLINE static void add_call(listing *l, const kmp_expr *e)
{
    switch (e->function) {
    case KMP_FUNCTION_sin:
    case KMP_FUNCTION_cos:
        add(l, e, KMP_ARGUMENT_WAVE, e->a);
        break;
    case KMP_FUNCTION_tan:
        add(l, e, KMP_ARGUMENT_WAVE, times(l, 2, e->a));
        break;
    case KMP_FUNCTION_exp:
        add(l, e, KMP_ARGUMENT_PEAK, e->a);
        break;
    case KMP_FUNCTION_sinh:
    case KMP_FUNCTION_cosh:
        add(l, e, KMP_ARGUMENT_PEAK, call(l, KMP_FUNCTION_abs, e->a));
        break;
    case KMP_FUNCTION_asin:
    case KMP_FUNCTION_acos:
    case KMP_FUNCTION_atan:
    case KMP_FUNCTION_tanh:
        add(l, e, KMP_ARGUMENT_STEP, e->a);
        break;
    case KMP_FUNCTION_log:
        add(l, e, KMP_ARGUMENT_STEP, log_of(l, e->a));
        break;
    case KMP_FUNCTION_pow:
        add_power(l, e);
        break;
    case KMP_FUNCTION_abs:
        add(l, e, KMP_ARGUMENT_SIZE, e->a);
        break;
    case KMP_FUNCTION_sign:
        add(l, e, KMP_ARGUMENT_KINK, e->a);
        break;
    case KMP_FUNCTION_min:
    case KMP_FUNCTION_max:
        add(l, e, KMP_ARGUMENT_KINK, of_two(l, KMP_EXPR_SUB, e->a, e->b));
        break;
    default:
        break;
    }
}

static void visit(listing *l, const kmp_expr *e)
{
    if (!e || kmp_expr_is_constant(e))
        return;
    for (const kmp_expr_argument *k = l->first; k; k = k->next)
        if (k->in == e)
            return;
    switch (e->kind) {
    case KMP_EXPR_CALL:
        add_call(l, e);
        break;
    case KMP_EXPR_LESS:
    case KMP_EXPR_AT_MOST:
    case KMP_EXPR_GREATER:
    case KMP_EXPR_AT_LEAST:
        add(l, e, KMP_ARGUMENT_KINK, of_two(l, KMP_EXPR_SUB, e->a, e->b));
        break;
    case KMP_EXPR_DIV:
        if (!kmp_expr_is_constant(e->b))
            add(l, e, KMP_ARGUMENT_PEAK, node(l, (kmp_expr){.kind = KMP_EXPR_NEG, .a = log_of(l, e->b)}));
        break;
    case KMP_EXPR_POW:
        add_power(l, e);
        break;
    case KMP_EXPR_TABLE:
        add_table(l, e);
        break;
    case KMP_EXPR_UNKNOWN:
        if (e->unknowns->count == 0)
            visit(l, e->unknowns->zero[0]);
        return;
    default:
        break;
    }
    visit(l, e->a);
    visit(l, e->b);
    visit(l, e->c);
}

bool kmp_expr_arguments(kmp_arena *arena, const kmp_expr *expr, const kmp_expr_argument **list)
{
    listing l = {.arena = arena};
    visit(&l, expr);
    *list = l.first;
    return !l.failed;
}
