/* SPDX-License-Identifier: BSD-3-Clause */
/* The dimension of an expression, from the units of its numbers and the dimensions of its parameters. A number without
 * unit is a plain factor in a product and fits any dimension as a whole value; t, q and qd are in SI and fit any
 * dimension. */
#include "model/language/expression_dimension.h"
#include "base/clones.h"
#include "model/language/expression.h"
#include "model/language/expression_value.h"
#include <string.h>

/* Rules of functions for dimensions. */
typedef enum rule {
    WANTS_NUMBER,  /* only of plain numbers */
    LIKE_ARGUMENT, /* the arguments fit each other, the value is like them */
    OF_CHOICE,     /* the second and third fit each other, the value is like them */
    OF_RATIO,      /* the arguments fit each other, the value is a number */
    OF_SIGN,       /* the value is like 1: 3*sign(v) is as good a force as 3 */
    SQUARE_ROOT
} rule;

typedef struct walk {
    const kmp_dimension *dimensions;
    const double *values;
    kmp_expr_fault *fault;
} walk;

static kmp_dimension dimension_of(walk *w, const kmp_expr *expr);

static rule rule_of(kmp_function function)
{
    static const struct {
        const char *name;
        rule rule;
    } rules[] = {{"sqrt", SQUARE_ROOT},   {"abs", LIKE_ARGUMENT}, {"min", LIKE_ARGUMENT}, {"max", LIKE_ARGUMENT},
                 {"wrap", LIKE_ARGUMENT}, {"atan2", OF_RATIO},    {"sign", OF_SIGN},      {"if", OF_CHOICE}};
    for (size_t k = 0; k < sizeof rules / sizeof rules[0]; k++)
        if (strcmp(kmp_function_name(function), rules[k].name) == 0)
            return rules[k].rule;
    return WANTS_NUMBER;
}

static void set_fault(walk *w, const kmp_expr *at, kmp_dimension a, kmp_dimension b)
{
    if (!w->fault->at)
        *w->fault = (kmp_expr_fault){at, a, b};
}

/* The dimension that fits both: the more definite of the two. */
static kmp_dimension agree(walk *w, const kmp_expr *at, kmp_dimension a, kmp_dimension b)
{
    if (!kmp_dimension_fits(a, b))
        set_fault(w, at, a, b);
    return a.kind > b.kind ? a : b;
}

KMP_NOINLINE static kmp_dimension dimension_of_call(walk *w, const kmp_expr *expr)
{
    kmp_dimension a = dimension_of(w, expr->a), b = expr->b ? dimension_of(w, expr->b) : a;
    switch (rule_of(expr->function)) {
    case SQUARE_ROOT:
        return kmp_dimension_power(a, 0.5);
    case LIKE_ARGUMENT:
        return agree(w, expr, a, b);
    case OF_CHOICE:
        return agree(w, expr, b, dimension_of(w, expr->c));
    case OF_RATIO:
        (void)agree(w, expr, a, b);
        return KMP_DIM_NUMBER;
    case OF_SIGN:
        return (kmp_dimension){.kind = KMP_DIMENSION_BARE};
    case WANTS_NUMBER:
        break;
    }
    if (kmp_dimension_is_physical(a) || kmp_dimension_is_physical(b))
        set_fault(w, expr, KMP_DIM_NUMBER, kmp_dimension_is_physical(a) ? a : b);
    return a.kind == KMP_DIMENSION_KNOWN ? KMP_DIM_NUMBER : a;
}

KMP_NOINLINE static kmp_dimension dimension_of_power(walk *w, const kmp_expr *expr)
{
    kmp_dimension base = dimension_of(w, expr->a), exponent = dimension_of(w, expr->b);
    if (kmp_dimension_is_physical(exponent))
        set_fault(w, expr, KMP_DIM_NUMBER, exponent);
    return kmp_dimension_power(base, kmp_expr_value(expr->b, w->values));
}

/* The first fault is the leftmost one. */
static kmp_dimension dimension_of_infix(walk *w, const kmp_expr *expr)
{
    kmp_dimension a = dimension_of(w, expr->a), b = dimension_of(w, expr->b);
    if (expr->kind == KMP_EXPR_MUL || expr->kind == KMP_EXPR_DIV)
        return kmp_dimension_times(a, b, expr->kind == KMP_EXPR_MUL ? 1 : -1);
    kmp_dimension both = agree(w, expr, a, b);
    return expr->kind == KMP_EXPR_ADD || expr->kind == KMP_EXPR_SUB ? both : KMP_DIM_NUMBER;
}

static kmp_dimension dimension_of(walk *w, const kmp_expr *expr)
{
    switch (expr->kind) {
    case KMP_EXPR_NUMBER:
        return expr->unit;
    case KMP_EXPR_INPUT: /* an input without unit may have any dimension */
        return expr->unit.kind == KMP_DIMENSION_BARE ? KMP_DIM_ANY : expr->unit;
    case KMP_EXPR_PARAMETER: /* a parameter without unit may have any dimension */
        return w->dimensions[expr->index].kind == KMP_DIMENSION_BARE ? KMP_DIM_ANY : w->dimensions[expr->index];
    case KMP_EXPR_NEG:
    case KMP_EXPR_CUT:
    case KMP_EXPR_SIDES:
        return dimension_of(w, expr->a);
    case KMP_EXPR_RATE:
        return kmp_dimension_times(dimension_of(w, expr->a), KMP_DIM_TIME, -1);
    case KMP_EXPR_ADD:
    case KMP_EXPR_SUB:
    case KMP_EXPR_MUL:
    case KMP_EXPR_DIV:
    case KMP_EXPR_LESS:
    case KMP_EXPR_AT_MOST:
    case KMP_EXPR_GREATER:
    case KMP_EXPR_AT_LEAST:
        return dimension_of_infix(w, expr);
    case KMP_EXPR_POW:
        return dimension_of_power(w, expr);
    case KMP_EXPR_CALL:
        return dimension_of_call(w, expr);
    default:
        return KMP_DIM_ANY;
    }
}

kmp_dimension kmp_expr_dimension(const kmp_expr *expr, const kmp_dimension *dimensions, const double *values,
                                 kmp_expr_fault *fault)
{
    walk w = {dimensions, values, fault};
    return dimension_of(&w, expr);
}

void kmp_expr_print_fault(kmp_text *text, const kmp_expr_fault *fault)
{
    static const char *const words[] = {
#define KMP_OPERATOR(kind, sign, bind, left, right, value, mismatch) [KMP_EXPR_##kind] = mismatch,
#include "model/language/operators.def"
#undef KMP_OPERATOR
    };
    kmp_expr_kind kind = fault->at->kind;
    kmp_dimension a = fault->a, b = fault->b;
    if (kind < sizeof words / sizeof *words && words[kind]) {
        kmp_dimension_print(text, b);
        kmp_text_printf(text, " cannot be %s ", words[kind]);
        kmp_dimension_print(text, a);
    } else if (kind == KMP_EXPR_POW) {
        kmp_text_put(text, "an exponent is a number without unit, not ");
        kmp_dimension_print(text, b);
    } else if (kmp_dimension_is_physical(a)) {
        kmp_text_printf(text, "the arguments of '%s' have different units: ", kmp_function_name(fault->at->function));
        kmp_dimension_print(text, a);
        kmp_text_put(text, " and ");
        kmp_dimension_print(text, b);
    } else {
        kmp_text_printf(text, "'%s' needs a number without unit or an angle, not ",
                        kmp_function_name(fault->at->function));
        kmp_dimension_print(text, b);
    }
}
