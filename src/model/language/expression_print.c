/* SPDX-License-Identifier: BSD-3-Clause */
/* Expressions as text that reads back to the same tree, with the fewest parentheses. */
#include "model/language/expression_print.h"
#include "model/language/expression.h"
#include <math.h>

/* Precedence of a node: a node of lower precedence than its position requires is put in parentheses. */
enum { BIND_COMPARISON, BIND_SUM, BIND_PRODUCT, BIND_NEGATIVE, BIND_POWER, BIND_PRIMARY };

static void print_within(kmp_text *text, const kmp_expr *expr, const kmp_expr_names *names, int place);

static void print_binary(kmp_text *text, const kmp_expr *expr, const kmp_expr_names *names, int place)
{
    static const struct {
        const char *sign;
        int bind, left, right;
    } operators[] = {
#define KMP_OPERATOR(kind, sign, bind, left, right, value, mismatch)                                                   \
    [KMP_EXPR_##kind] = {sign, BIND_##bind, BIND_##left, BIND_##right},
#include "model/language/operators.def"
#undef KMP_OPERATOR
    };
    bool open = operators[expr->kind].bind < place;
    kmp_text_put(text, open ? "(" : "");
    print_within(text, expr->a, names, operators[expr->kind].left);
    kmp_text_put(text, operators[expr->kind].sign);
    print_within(text, expr->b, names, operators[expr->kind].right);
    kmp_text_put(text, open ? ")" : "");
}

static void print_call(kmp_text *text, const kmp_expr *expr, const kmp_expr_names *names)
{
    kmp_text_printf(text, "%s(", kmp_function_name(expr->function));
    const kmp_expr *arguments[] = {expr->a, expr->b, expr->c};
    for (int k = 0; k < 3 && arguments[k]; k++) {
        kmp_text_put(text, k ? ", " : "");
        print_within(text, arguments[k], names, k ? BIND_SUM : BIND_COMPARISON);
    }
    kmp_text_put(text, ")");
}

static const char *const bearing_components[] = {"1.x", "1.y", "1.z", "2.x", "2.y", "2.z", "axial", "1.size", "2.size"};

/* distance(a.P, b.Q), position(b.P).x, axes(b.P).z.x */
static void print_measure(kmp_text *text, const kmp_measure *measure, int number)
{
    kmp_text_printf(text, "%s(", measure->word);
    for (int k = 0; k < measure->count; k++) {
        const kmp_measure_argument *argument = &measure->argument[k];
        kmp_text_printf(text, "%s%s", k ? ", " : "", argument->name);
        if (argument->axis >= 0)
            kmp_text_printf(text, ".%c", "xyz"[argument->axis]);
    }
    kmp_text_put(text, ")");
    if (measure->kind == KMP_MEASURE_BEARING) {
        kmp_text_printf(text, ".%s", bearing_components[number]);
        return;
    }
    if (measure->components > 3)
        kmp_text_printf(text, ".%c", "xyz"[number / 3]);
    if (measure->components == 3 && number == KMP_MEASURE_SIZE)
        kmp_text_put(text, ".size");
    else if (measure->components > 1)
        kmp_text_printf(text, ".%c", "xyz"[number % 3]);
}

static void print_within(kmp_text *text, const kmp_expr *expr, const kmp_expr_names *names, int place)
{
    static const char *const places[] = {"x", "y", "z", "depth", "rate", "impact", "slip"};
    switch (expr->kind) {
    case KMP_EXPR_NUMBER:
        if (isinf(expr->value))
            kmp_text_put(text, "unlimited");
        else
            kmp_text_number(text, expr->value);
        break;
    case KMP_EXPR_PARAMETER:
        kmp_text_put(text, kmp_name_at(names->parameters, expr->index));
        break;
    case KMP_EXPR_INPUT:
        kmp_text_put(text, kmp_name_at(names->inputs, expr->index));
        break;
    case KMP_EXPR_PLACE:
        kmp_text_put(text, places[expr->index]);
        break;
    case KMP_EXPR_TIME:
        kmp_text_put(text, "t");
        break;
    case KMP_EXPR_Q:
        kmp_text_printf(text, "q(%s)", kmp_name_at(names->coordinates, expr->index));
        break;
    case KMP_EXPR_QD:
        kmp_text_printf(text, expr->index < names->coordinates.count - names->states ? "qd(%s)" : "%s",
                        kmp_name_at(names->coordinates, expr->index));
        break;
    case KMP_EXPR_LAMBDA:
        if (expr->measure)
            kmp_text_printf(text, "%s(%s).%s", expr->measure->word, kmp_name_at(names->closures, expr->index),
                            expr->number == KMP_MEASURE_SIZE ? "size"
                                                             : (const char *const[]){"x", "y", "z"}[expr->number]);
        else if (expr->number < 0)
            kmp_text_printf(text, "|reaction(%s)|", kmp_name_at(names->closures, expr->index));
        else
            kmp_text_printf(text, "lambda(%s.%d)", kmp_name_at(names->closures, expr->index), expr->number + 1);
        break;
    case KMP_EXPR_UNKNOWN:
        kmp_text_put(text, expr->unknowns->count ? expr->unknowns->unknown[expr->number] : expr->unknowns->name);
        break;
    case KMP_EXPR_MEASURE:
    case KMP_EXPR_CUT:
        print_measure(text, expr->measure, expr->number);
        break;
    case KMP_EXPR_SIDES:
        kmp_text_put(text, "[");
        print_within(text, expr->a, names, BIND_SUM);
        kmp_text_put(text, ", ");
        print_within(text, expr->b, names, BIND_SUM);
        kmp_text_put(text, "]");
        break;
    case KMP_EXPR_RATE:
        kmp_text_put(text, "rate(");
        print_within(text, expr->a, names, BIND_SUM);
        kmp_text_put(text, ")");
        break;
    case KMP_EXPR_NEG:
        kmp_text_put(text, place > BIND_NEGATIVE ? "(-" : "-");
        print_within(text, expr->a, names, BIND_NEGATIVE);
        kmp_text_put(text, place > BIND_NEGATIVE ? ")" : "");
        break;
    case KMP_EXPR_TABLE:
        kmp_text_printf(text, "%s(", expr->table->name);
        print_within(text, expr->a, names, BIND_SUM);
        if (expr->b) {
            kmp_text_put(text, ", ");
            print_within(text, expr->b, names, BIND_SUM);
        }
        kmp_text_put(text, ")");
        break;
    case KMP_EXPR_CALL:
        print_call(text, expr, names);
        break;
    default:
        print_binary(text, expr, names, place);
    }
}

void kmp_expr_print(kmp_text *text, const kmp_expr *expr, const kmp_expr_names *names)
{
    print_within(text, expr, names, BIND_COMPARISON);
}
