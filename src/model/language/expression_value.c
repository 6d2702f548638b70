/* SPDX-License-Identifier: BSD-3-Clause */
/* The numbers of expressions. */
#include "model/language/expression_value.h"
#include "model/language/expression.h"
#include "symbolic/table_function.h"
#include <math.h>

static double call(kmp_function function, double a, double b, double c)
{
    switch (function) {
#define KMP_FUNCTION(name, arity, value, node)                                                                         \
    case KMP_FUNCTION_##name:                                                                                          \
        return value;
#include "model/language/functions.def"
#undef KMP_FUNCTION
    case KMP_FUNCTION_COUNT:
        break;
    }
    return NAN;
}

double kmp_table_end(const kmp_named_table *table, int end)
{
    const kmp_surface *s = table->surface;
    int variable = end / 2, last = (s ? s->count[variable] : table->table->count) - 1;
    return (s ? s->knot[variable] : table->table->x)[end % 2 ? last : 0];
}

/* An argument of a table within its range where it is held there; no number where it must not leave it. */
static double within(const kmp_named_table *table, int variable, double x)
{
    double first = kmp_table_end(table, 2 * variable), last = kmp_table_end(table, 2 * variable + 1);
    if (table->outside == KMP_OUTSIDE_HOLD)
        return fmin(fmax(x, first), last);
    return table->outside == KMP_OUTSIDE_ERROR && !(x >= first && x <= last) ? NAN : x;
}

static double value_of_table(const kmp_named_table *table, double x)
{
    double first = kmp_table_end(table, 0), period = kmp_table_end(table, 1) - first;
    double turns = table->periodic ? floor((x - first) / period) : 0;
    if (table->periodic)
        return kmp_table_value(table->table, 0, x - period * turns) + table->rise * turns;
    return kmp_table_value(table->table, 0, within(table, 0, x));
}

bool kmp_extent_is_long(kmp_extent extent)
{
    return extent.level > KMP_MOST_NAME_LEVELS || extent.size > KMP_MOST_WRITTEN_OUT;
}

kmp_extent kmp_expr_extent(const kmp_expr *expr, const kmp_extent *of)
{
    const kmp_expr *const operand[] = {expr->a, expr->b, expr->c};
    kmp_extent whole = {0, 1}, name = {0};
    if (expr->kind == KMP_EXPR_UNKNOWN)
        name = expr->unknowns->extent;
    if (expr->kind == KMP_EXPR_PARAMETER && of)
        name = of[expr->index];
    whole.level = name.level + (name.size > 0);
    whole.size += name.size;
    for (int k = 0; k < 3; k++) {
        kmp_extent one = operand[k] ? kmp_expr_extent(operand[k], of) : (kmp_extent){0};
        whole.level = one.level > whole.level ? one.level : whole.level;
        whole.size += one.size;
    }
    return whole;
}

double kmp_number_at(const kmp_number *number, const double *parameters)
{
    return number->expr ? kmp_expr_value(number->expr, parameters) : number->value;
}

double kmp_expr_value_of(const kmp_expr *expr, const double *parameters, const int *constants, double t)
{
    const bool named = expr->kind == KMP_EXPR_UNKNOWN && expr->unknowns->count == 0 && expr->unknowns->zero[0];
    if (named) /* its operands are below it, too */
        return kmp_expr_value_of(expr->unknowns->zero[0], parameters, constants, t);
    double a = expr->a ? kmp_expr_value_of(expr->a, parameters, constants, t) : 0;
    double b = expr->b ? kmp_expr_value_of(expr->b, parameters, constants, t) : 0;
    double c = expr->c ? kmp_expr_value_of(expr->c, parameters, constants, t) : 0;
    switch (expr->kind) {
    case KMP_EXPR_NUMBER:
        return expr->value;
    case KMP_EXPR_PARAMETER:
        return parameters[expr->index];
    case KMP_EXPR_NEG:
        return -a;
#define KMP_OPERATOR(kind, sign, bind, left, right, value, mismatch)                                                   \
    case KMP_EXPR_##kind:                                                                                              \
        return value;
#include "model/language/operators.def"
#undef KMP_OPERATOR
    case KMP_EXPR_CALL:
        return call(expr->function, a, b, c);
    case KMP_EXPR_TABLE: /* the error of one that could not be read is already reported */
        return expr->table->table ? value_of_table(expr->table, a)
               : expr->table->surface
                   ? kmp_surface_value(expr->table->surface, within(expr->table, 0, a), within(expr->table, 1, b))
                   : 0;
    case KMP_EXPR_TIME:
        return t;
    case KMP_EXPR_RATE: /* of a constant: functions of t have none */
        return 0;
    case KMP_EXPR_INPUT:
        if (constants && constants[expr->index] > 0)
            return parameters[constants[expr->index] - 1];
        return isnan(t) ? NAN : expr->value;
    default:
        return NAN;
    }
}

double kmp_expr_value_at(const kmp_expr *expr, const double *parameters, double t)
{
    return kmp_expr_value_of(expr, parameters, NULL, t);
}

double kmp_expr_value(const kmp_expr *expr, const double *parameters)
{
    return kmp_expr_value_at(expr, parameters, NAN);
}

const kmp_expr *kmp_expr_find(const kmp_expr *expr, kmp_expr_test is, const void *user)
{
    if (!expr || is(expr, user))
        return expr;
    const kmp_expr *found = kmp_expr_find(expr->a, is, user);
    found = found ? found : kmp_expr_find(expr->b, is, user);
    return found ? found : kmp_expr_find(expr->c, is, user);
}

const kmp_expr *kmp_expr_find_named(const kmp_expr *expr, kmp_expr_test is, const void *user)
{
    if (!expr || is(expr, user))
        return expr;
    if (expr->kind == KMP_EXPR_UNKNOWN)
        return expr->unknowns && expr->unknowns->count == 0 ? kmp_expr_find_named(expr->unknowns->zero[0], is, user)
                                                            : NULL;
    const kmp_expr *found = kmp_expr_find_named(expr->a, is, user);
    found = found ? found : kmp_expr_find_named(expr->b, is, user);
    return found ? found : kmp_expr_find_named(expr->c, is, user);
}

static bool same_measure(const kmp_measure *a, const kmp_measure *b)
{
    bool same = a->kind == b->kind && a->count == b->count;
    for (int k = 0; same && k < a->count; k++)
        same = a->argument[k].point == b->argument[k].point && a->argument[k].axis == b->argument[k].axis &&
               a->argument[k].closure == b->argument[k].closure;
    return same;
}

bool kmp_expr_same_leaf(const kmp_expr *a, const kmp_expr *b)
{
    return a->kind == b->kind && a->index == b->index && a->number == b->number && a->a == b->a &&
           !a->measure == !b->measure && (!a->measure || same_measure(a->measure, b->measure));
}

static bool is_lambda(const kmp_expr *expr, const void *user)
{
    (void)user;
    return expr->kind == KMP_EXPR_LAMBDA;
}

const kmp_expr *kmp_expr_lambda(const kmp_expr *expr)
{
    return kmp_expr_find(expr, is_lambda, NULL);
}

bool kmp_expr_is_time(const kmp_expr *expr, const void *unused)
{
    (void)unused;
    return expr->kind == KMP_EXPR_TIME;
}

bool kmp_expr_is_input(const kmp_expr *expr, const void *unused)
{
    (void)unused;
    return expr->kind == KMP_EXPR_INPUT;
}

static bool is_time(const kmp_expr *expr, const void *user)
{
    return kmp_expr_is_time(expr, user) || kmp_expr_is_input(expr, user);
}

bool kmp_expr_has_time(const kmp_expr *expr)
{
    return kmp_expr_find(expr, is_time, NULL);
}

bool kmp_expr_compares(const kmp_expr *expr, const void *unused)
{
    (void)unused;
    return (expr->kind >= KMP_EXPR_LESS && expr->kind <= KMP_EXPR_AT_LEAST) ||
           (expr->kind == KMP_EXPR_CALL && expr->function == KMP_FUNCTION_sign);
}

static bool is_variable(const kmp_expr *expr, const void *user)
{
    return is_time(expr, user) || expr->kind == KMP_EXPR_Q || expr->kind == KMP_EXPR_QD ||
           expr->kind == KMP_EXPR_LAMBDA || expr->kind == KMP_EXPR_UNKNOWN || expr->kind == KMP_EXPR_PLACE ||
           expr->kind == KMP_EXPR_MEASURE;
}

bool kmp_expr_is_constant(const kmp_expr *expr)
{
    return !kmp_expr_find(expr, is_variable, NULL);
}
