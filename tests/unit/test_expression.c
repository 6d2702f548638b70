/* SPDX-License-Identifier: BSD-3-Clause */
/* Expressions: values, precedence, complaints with their columns, and text that reads back. */
#include "model/language/expression.h"
#include "model/language/expression_print.h"
#include "model/language/expression_value.h"
#include "testing.h"
#include <string.h>

static kempe_context *context;
static const char *const parameter_names[] = {"crank", "half", "g"};
static const double parameter_values[] = {0.3, 0.15, 9.81};
static const char *const coordinate_names[] = {"A", "B.2"}, *const closure_names[] = {"loop", "D"};

static int find(const char *const *names, int n, const char *name)
{
    for (int i = 0; i < n; i++)
        if (strcmp(names[i], name) == 0)
            return i;
    return -1;
}

static int find_parameter(void *user, const char *name)
{
    (void)user;
    return find(parameter_names, 3, name);
}

static int find_coordinate(void *user, const char *name)
{
    (void)user;
    return find(coordinate_names, 2, name);
}

static int find_closure(void *user, const char *name)
{
    (void)user;
    return find(closure_names, 2, name);
}

static const kmp_expr *parse(kmp_arena *arena, const char *text, bool constant)
{
    kmp_expr_scope scope = {.context = context,
                            .arena = arena,
                            .file = "f",
                            .line = 1,
                            .column = 1,
                            .parameter = find_parameter,
                            .coordinate = constant ? NULL : find_coordinate,
                            .closure = constant ? NULL : find_closure,
                            .time = !constant};
    kmp_context_clear(context);
    return kmp_expr_parse(&scope, text);
}

static double value(const char *text)
{
    kmp_arena arena = {0};
    const kmp_expr *expr = parse(&arena, text, true);
    double x = expr ? kmp_expr_value(expr, parameter_values) : NAN;
    if (!expr)
        printf("%s: %s\n", text, kempe_context_message(context));
    kmp_arena_free(&arena);
    return x;
}

static void values(void)
{
    CHECK_NEAR(value("1 + 2*3"), 7, 0);
    CHECK_NEAR(value("10 - 4 - 3"), 3, 0);
    CHECK_NEAR(value("12/3/2"), 2, 0);
    CHECK_NEAR(value("-2^2"), -4, 0);
    CHECK_NEAR(value("2^-1"), 0.5, 0);
    CHECK_NEAR(value("2^3^2"), 512, 0);
    CHECK_NEAR(value("(2^3)^2"), 64, 0);
    CHECK_NEAR(value("--3"), 3, 0);
    CHECK_NEAR(value("2*-3"), -6, 0);
    CHECK_NEAR(value(" 1e-3 + .5 + 5. + 2E+1"), 25.501, 1e-15);
    CHECK_NEAR(value("crank/2 - half"), 0, 0);
    CHECK_NEAR(value("sin(pi/6)"), 0.5, 1e-15);
    CHECK_NEAR(value("sqrt(2)^2"), 2, 1e-15);
    CHECK_NEAR(value("300 mm"), 0.3, 0);
    CHECK_NEAR(value("2*(180 deg)"), 6.28318530717958648, 1e-15);
    CHECK_NEAR(value("-10 ms + 1e3g"), 0.99, 0);
    CHECK_NEAR(value("log(exp(cos(0)))"), 1, 1e-15);
    CHECK_NEAR(value("if(1 < 2, 3, 4) + 10*if(1 >= 2, 3, 4) + 100*if(2 <= 2, 1, 0) + if(2 > 2, 1000, 0)"), 143, 0);
    CHECK_NEAR(value("min(1, 2) + 10*max(1, 2) + 100*abs(-3) + 1000*sign(-2)"), -679, 0);
    CHECK_NEAR(value("floor(-1.5) + 10*floor(2) + 100*wrap(7, 2) + 1000*wrap(1, 2) + 1e4*wrap(-1, 2)"), 18 - 11100, 0);
    CHECK_NEAR(value("pow(2, 0.5) - sqrt(2) + atan2(1, -1) - 0.75*pi + tanh(0) + asin(0) + acos(1) + atan(0)"), 0,
               1e-15);
}

static void kinds(void)
{
    kmp_arena arena = {0};
    const kmp_expr *expr = parse(&arena, "0.2 - 0.01*qd( B.2 ) + t*q(A)", false);
    CHECK(expr != NULL);
    CHECK(expr && !kmp_expr_is_constant(expr));
    CHECK(expr && isnan(kmp_expr_value(expr, parameter_values)));
    CHECK(expr && expr->kind == KMP_EXPR_ADD && expr->b->b->kind == KMP_EXPR_Q && expr->b->b->index == 0);
    expr = parse(&arena, "crank^2*3", false);
    CHECK(expr && kmp_expr_is_constant(expr));
    kmp_arena_free(&arena);
}

static void complains(const char *text, bool constant, const char *message)
{
    kmp_arena arena = {0};
    CHECK(parse(&arena, text, constant) == NULL);
    if (strncmp(kempe_context_message(context), message, strlen(message)) != 0)
        CHECK_TEXT(kempe_context_message(context), message);
    kmp_arena_free(&arena);
}

static void complaints(void)
{
    complains("", true, "f:1:1: a number, a name or '(' is expected, but the expression ends");
    complains("1 + ", true, "f:1:5: a number, a name or '(' is expected, but");
    complains("1 + * 2", true, "f:1:5: a number, a name or '(' is expected here, not '*'");
    complains("(1 + 2", true, "f:1:7: an operator or ')' is expected, but");
    complains("1 2", true, "f:1:3: an operator or the end is expected here, not '2'");
    complains("300 inch", true, "f:1:5: an operator or a unit is expected here, not 'inch': its unit is written 'in'");
    complains("3 t", true, "f:1:3: an operator or a unit is expected here, not 't': its unit is written 'tonne'");
    complains("3 knm", true, "f:1:3: an operator or a unit is expected here, not 'knm'; did you mean 'kNm'?");
    complains("2*krank", true, "f:1:3: unknown parameter 'krank'");
    complains("sine(1)", true, "f:1:1: unknown function 'sine'; did you mean 'sin'?");
    complains("sin(1, 2)", true, "f:1:1: function 'sin' takes 1 argument, not 2");
    complains("if(1, 2, 3)", true, "f:1:5: an operator, '<', '<=', '>' or '>=' is expected here, not ','");
    complains("if(1 < 2, 3)", true, "f:1:1: function 'if' takes 3 arguments, not 2");
    complains("1 < 2", true, "f:1:3: an operator or the end is expected here, not '<'");
    complains("sin()", true, "f:1:1: function 'sin' takes 1 argument, not 0");
    complains("sin + 1", true, "f:1:1: function 'sin' needs its argument");
    complains("1 + t", true, "f:1:5: t is not allowed here");
    complains("q(A)", true, "f:1:1: q is not allowed here");
    complains("qd(C)", false, "f:1:4: unknown coordinate 'C'");
    complains("q + 1", false, "f:1:1: 'q' needs a coordinate in parentheses");
    complains("q(A.)", false, "f:1:4: ')' is expected here");
    complains("1 + floor(q(A))", false, "f:1:5: 'floor' jumps, and only sensors");
    complains("q(A)*wrap(2*t, 3)", false, "f:1:6: 'wrap' jumps, and only sensors");
    complains("wrap(2)", true, "f:1:1: function 'wrap' takes 2 arguments, not 1");
    complains("1 + lambda(loop)", true, "f:1:5: lambda is not allowed here: a constant is expected");
    complains("lambda(lop)", false, "f:1:8: unknown loop 'lop'");
    complains("lambda(D.0)", false,
              "f:1:10: the number of a multiplier is expected here: lambda(D.1) is the first one");
    complains("lambda(D.2", false, "f:1:11: ')' is expected, but the expression ends");
    complains("lambda(2)", false, "f:1:8: the name of a loop is expected here, not '2'");
    complains("lambda + 1", false, "f:1:1: unknown parameter 'lambda'");
    complains("2^lambda(D)", false, "f:1:3: an exponent must be constant");
    complains("2^t", false, "f:1:3: an exponent must be constant");
    complains("crank(2)", true, "f:1:1: 'crank' is a parameter, not a function");
    complains("\xc3\xa4\xc3\xb6 + \xe2\x82\xac", true, "f:1:1: unknown parameter");
    complains("crank + 2 \xc3\x97 3", true, "f:1:11: an operator or a unit is expected here, not '\xc3\x97';");
    complains("0x10", true, "f:1:2: an operator or a unit is expected here, not 'x10'");
}

static void limits(void)
{
    char text[20001];
    memset(text, '(', 1000);
    strcpy(text + 1000, "1");
    complains(text, true, "f:1:201: the expression is nested too deeply");
    memset(text, '-', 1000);
    complains(text, true, "f:1:201: the expression is nested too deeply");
    for (int i = 0; i < 10000; i++)
        memcpy(text + 2 * i, "1+", 2);
    strcpy(text + 19999, "");
    complains(text, true, "f:1:1: the expression is too long");
}

static void prints(const char *text, const char *expected)
{
    const kmp_expr_names names = {
        KMP_NAMES_OF(parameter_names), KMP_NAMES_OF(coordinate_names), KMP_NAMES_OF(closure_names), {0}, 0};
    kmp_arena arena = {0};
    kmp_text first = {0}, second = {0};
    const kmp_expr *expr = parse(&arena, text, false);
    CHECK(expr != NULL);
    if (expr) {
        kmp_expr_print(&first, expr, &names);
        CHECK_TEXT(first.s, expected);
        expr = parse(&arena, first.s, false);
        CHECK(expr != NULL);
        if (expr)
            kmp_expr_print(&second, expr, &names);
        CHECK_TEXT(second.s ? second.s : "", expected);
    }
    kmp_text_free(&first);
    kmp_text_free(&second);
    kmp_arena_free(&arena);
}

static void printing(void)
{
    prints("0.2-0.01 * qd(A)", "0.2 - 0.01*qd(A)");
    prints("0.3*abs( lambda(loop) )+lambda( D.2)", "0.3*abs(lambda(loop.1)) + lambda(D.2)");
    prints("1-(2-3)", "1 - (2 - 3)");
    prints("(1-2)-3", "1 - 2 - 3");
    prints("6/(3*2)", "6/(3*2)");
    prints("(crank+half)^2", "(crank + half)^2");
    prints("(2^3)^2", "(2^3)^2");
    prints("2^3^2", "2^3^2");
    prints("-(2^2)", "-2^2");
    prints("(-2)^2", "(-2)^2");
    prints("2*(-q(B.2))", "2*-q(B.2)");
    prints("sin((t))", "sin(t)");
    prints("if(q(A)<-1e-3,min(t,(2)),3*if(t>=2+1,1,0))", "if(q(A) < -0.001, min(t, 2), 3*if(t >= 2 + 1, 1, 0))");
}

int main(void)
{
    context = kempe_context_new();
    TEST(values);
    TEST(kinds);
    TEST(complaints);
    TEST(limits);
    TEST(printing);
    kempe_context_free(context);
    return check_report();
}
