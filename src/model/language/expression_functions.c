/* SPDX-License-Identifier: BSD-3-Clause */
/* Functions of the expression language: those with an operation of their own, and those that others are made of. */
#include "model/language/expression_functions.h"
#include "model/language/expression.h"
#include "model/language/expression_parser.h"
#include "model/language/expression_references.h"
#include "model/language/limits.h"
#include <string.h>

enum { MOST_ARGUMENTS = 5 };

static const struct {
    const char *name;
    int arity;
} functions[] = {
#define KMP_FUNCTION(name, arity, value, node) {#name, arity},
#include "model/language/functions.def"
#undef KMP_FUNCTION
};

/* Functions that others are made of: their arguments, and what they are. */
static const struct {
    const char *name;
    int arity;
    const char *argument[MOST_ARGUMENTS];
    const char *formula;
} composites[] = {
#define KMP_COMPOSITE(name, arity, arguments, formula) {#name, arity, arguments, formula},
#define KMP_ARGUMENTS(...)                                                                                             \
    {                                                                                                                  \
        __VA_ARGS__                                                                                                    \
    }
#include "model/language/composites.def"
#undef KMP_ARGUMENTS
#undef KMP_COMPOSITE
};

static int find_function(const char *name)
{
    return kmp_name_find(KMP_NAMES_OF(functions), name);
}

const char *kmp_outside_word(kmp_outside outside)
{
    static const char *const words[] = {"", "linear", "hold", "error"};
    return words[outside];
}

const char *kmp_function_name(kmp_function function)
{
    return functions[function].name;
}

bool kmp_parse_is_function(const char *name)
{
    return find_function(name) >= 0 || kmp_name_find(KMP_NAMES_OF(composites), name) >= 0;
}

/* -- errors ------------------------------------------------------------------------------------------ */

KMP_NOINLINE static const kmp_expr *complain_function(const kmp_parser *p, const char *where, const char *name)
{
    kmp_text sentence = {0};
    kmp_nearest nearest = kmp_nearest_of(name, KMP_NAMES_OF(functions));
    kmp_nearest_offer_all(&nearest, KMP_NAMES_OF(composites));
    kmp_nearest_offer_all(&nearest, kmp_measure_words);
    kmp_text_printf(&sentence, "unknown function '%s'", name);
    kmp_nearest_suggest(&nearest, &sentence);
    return kmp_parse_say(p, where, &sentence);
}

/* -- calls ------------------------------------------------------------------------------------------- */

/* The arguments of a function, from the opening parenthesis on: how many, -1 after an error. Those beyond the most are
 * counted alone. */
static int parse_arguments(kmp_parser *p, const char *where, const char *name, bool compares,
                           const kmp_expr *arguments[MOST_ARGUMENTS])
{
    int count = 0;
    if (!kmp_parse_take(p, '(')) {
        kmp_parse_complain(p, where, "function '%s' needs its argument in parentheses", name);
        return -1;
    }
    if (kmp_parse_take(p, ')'))
        return 0;
    do {
        const kmp_expr *argument = compares && count == 0 ? kmp_parse_comparison(p) : kmp_parse_sum(p);
        if (!argument)
            return -1;
        if (count < MOST_ARGUMENTS)
            arguments[count] = argument;
        count++;
    } while (kmp_parse_take(p, ','));
    if (kmp_parse_take(p, ')'))
        return count;
    kmp_parse_wanted(p, "an operator, ',' or ')'");
    return -1;
}

static const kmp_expr *complain_count(const kmp_parser *p, const char *where, const char *name, int arity, int count)
{
    return kmp_parse_complain(p, where, "function '%s' takes %d argument%s, not %d", name, arity, arity == 1 ? "" : "s",
                              count);
}

/* Operations and operands of a tree, counted up to a limit: shared parts count each time, as others walk through them.
 */
static int size_up_to(const kmp_expr *e, int limit)
{
    if (!e || limit < 0)
        return 0;
    int size = 1 + size_up_to(e->a, limit - 1);
    size += size_up_to(e->b, limit - size);
    return size + size_up_to(e->c, limit - size);
}

KMP_NOINLINE static const kmp_expr *make_composite(kmp_parser *p, const char *where, int index,
                                                   const kmp_expr *const *arguments)
{
    kmp_expr_locals locals = {.count = composites[index].arity};
    for (int k = 0; k < locals.count; k++)
        locals.local[k] = (kmp_expr_local){composites[index].argument[k], arguments[k], false};
    const kmp_expr *made = kmp_expr_formula(p->scope->arena, composites[index].formula, &locals);
    p->nodes += size_up_to(made, KMP_MOST_EXPRESSION_NODES);
    return made ? kmp_parse_make(p, where, *made) : NULL;
}

KMP_NOINLINE static const kmp_expr *make_call(kmp_parser *p, const char *where, int function,
                                              const kmp_expr *const *arguments)
{
    return kmp_parse_make(p, where,
                          (kmp_expr){.kind = KMP_EXPR_CALL,
                                     .function = (kmp_function)function,
                                     .a = arguments[0],
                                     .b = arguments[1],
                                     .c = arguments[2]});
}

const kmp_expr *kmp_parse_call(kmp_parser *p, const char *where, const char *name)
{
    const kmp_expr *arguments[MOST_ARGUMENTS] = {NULL};
    int function = find_function(name), composite = kmp_name_find(KMP_NAMES_OF(composites), name);
    if (composite < 0 && function < 0)
        return complain_function(p, where, name);
    int count = parse_arguments(p, where, name, composite < 0 && function == KMP_FUNCTION_if, arguments);
    int arity = composite < 0 ? functions[function].arity : composites[composite].arity;
    if (count >= 0 && count != arity)
        return complain_count(p, where, name, arity, count);
    return count < 0       ? NULL
           : composite < 0 ? make_call(p, where, function, arguments)
                           : make_composite(p, where, composite, arguments);
}

const kmp_expr *kmp_expr_formula(kmp_arena *arena, const char *text, const kmp_expr_locals *locals)
{
    const kmp_expr_scope scope = {.arena = arena, .file = "", .locals = locals};
    return kmp_expr_parse(&scope, text);
}
