/* SPDX-License-Identifier: BSD-3-Clause */
/* A number with its unit from outside of a model file, by the expressions of the language. */
#include "base/arena.h"
#include "model/language/expression.h"
#include "model/language/expression_dimension.h"
#include "model/language/expression_value.h"
#include <kempe/kempe.h>
#include <kempe/settings.h>
#include <math.h>
#include <string.h>

static kempe_status evaluate(kempe_context *context, const kmp_expr *expr, const char *text, const char *unit,
                             kmp_dimension wanted, double *value)
{
    kmp_expr_fault fault = {0};
    kmp_text sentence = {0};
    kmp_dimension found = kmp_expr_dimension(expr, NULL, NULL, &fault);
    double x = kmp_expr_value(expr, NULL);
    if (!fault.at && kmp_dimension_fits(found, wanted) && isfinite(x)) {
        *value = x;
        return KEMPE_OK;
    }
    if (fault.at)
        kmp_expr_print_fault(&sentence, &fault);
    else if (isfinite(x))
        kmp_dimension_print(&sentence, found);
    kempe_status status = sentence.failed ? kmp_fail_memory(context)
                          : fault.at      ? kmp_fail(context, KEMPE_E_ARGUMENT, "'%s': %s", text, sentence.s)
                          : isfinite(x)   ? kmp_fail(context, KEMPE_E_ARGUMENT,
                                                     "'%s' is in %s: a number in %s is expected", text, sentence.s, unit)
                                          : kmp_fail(context, KEMPE_E_ARGUMENT, "'%s' is not a finite number", text);
    kmp_text_free(&sentence);
    return status;
}

kempe_status kempe_number_read(kempe_context *context, const char *text, const char *unit, double *value)
{
    kmp_unit wanted;
    kmp_arena arena = {0};
    KMP_WANTED(NULL, context, "context");
    KMP_WANTED(context, text, "text");
    KMP_WANTED(context, unit, "unit");
    KMP_WANTED(context, value, "value");
    kmp_context_clear(context);
    if (!kmp_unit_find(unit, strlen(unit), &wanted))
        return kmp_fail(context, KEMPE_E_ARGUMENT, "unknown unit '%s'", unit);
    const kmp_expr_scope scope = {.context = context, .arena = &arena, .file = "number", .line = 1, .column = 1};
    const kmp_expr *expr = kmp_expr_parse(&scope, text);
    kempe_status status = expr           ? evaluate(context, expr, text, unit, wanted.dimension, value)
                          : arena.failed ? kmp_fail_memory(context)
                                         : KEMPE_E_ARGUMENT;
    if (status == KEMPE_OK)
        *value *= wanted.divisor / wanted.factor;
    kmp_arena_free(&arena);
    return status;
}
