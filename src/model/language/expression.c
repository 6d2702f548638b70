/* SPDX-License-Identifier: BSD-3-Clause */
/* Expressions: recursive descent, one function for each rule of the grammar in docs/model/expressions.md. The first
 * error ends the parse. Nesting and size are limited, so that no text can exhaust the stack, here or in functions that
 * traverse the tree. */
#include "model/language/expression.h"
#include "model/language/expression_parser.h"
#include "model/language/expression_references.h"
#include "model/language/expression_value.h"
#include "model/language/limits.h"
#include "model/language/nearest.h"
#include <ctype.h>
#include <math.h>
#include <string.h>

static const kmp_expr *parse_factor(kmp_parser *p);

/* -- words --------------------------------------------------------------------------------------- */

static bool begins_word(char c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || (c & 0x80);
}

static bool is_digit(char c)
{
    return c >= '0' && c <= '9';
}

void kmp_parse_skip_space(kmp_parser *p)
{
    p->at += strspn(p->at, " \t\r\n");
}

bool kmp_parse_take(kmp_parser *p, char c)
{
    kmp_parse_skip_space(p);
    if (*p->at != c)
        return false;
    p->at++;
    return true;
}

size_t kmp_parse_word_length(const char *s)
{
    size_t n = 0;
    if (begins_word(s[0]))
        while (begins_word(s[n]) || is_digit(s[n]))
            n++;
    return n;
}

size_t kmp_parse_name_length(const char *s)
{
    static const char port[] = "port.";
    const size_t n = kmp_parse_word_length(s), first = sizeof port - 1;
    const size_t more = n + 1 == first && strncmp(s, port, first) == 0 ? kmp_parse_word_length(s + first) : 0;
    return more > 0 ? first + more : n;
}

/* A zero-ended copy of the n characters at p->at, which are passed. */
const char *kmp_parse_copy(kmp_parser *p, size_t n)
{
    char *word = kmp_arena_alloc(p->scope->arena, n + 1, 1);
    if (word)
        memcpy(word, p->at, n);
    p->at += n;
    return word;
}

/* -- errors -------------------------------------------------------------------------------------- */

/* Columns count characters, so the later bytes of a UTF-8 sequence do not. */
int kmp_parse_column(const kmp_parser *p, const char *where)
{
    int column = p->scope->column;
    for (const char *s = p->text; s < where; s++)
        column += ((unsigned char)*s & 0xc0) != 0x80;
    return column;
}

/* Reports a sentence, which is freed. */
static const kmp_expr *parse_say(const kmp_parser *p, const char *where, kmp_text *sentence)
{
    const kmp_expr_scope *scope = p->scope;
    bool failed = sentence->failed || scope->arena->failed;
    if (failed || kmp_complain(scope->context, scope->file, scope->line, kmp_parse_column(p, where), "%s",
                               sentence->s) == KEMPE_E_MEMORY)
        scope->arena->failed = true;
    kmp_text_free(sentence);
    return NULL;
}

__attribute__((format(printf, 3, 4))) const kmp_expr *kmp_parse_complain(const kmp_parser *p, const char *where,
                                                                         const char *format, ...)
{
    kmp_text sentence = {0};
    KMP_TEXT_ARGUMENTS(&sentence, format);
    return parse_say(p, where, &sentence);
}

const kmp_expr *kmp_parse_unknown_name(const kmp_parser *p, const char *where, const char *name, kmp_expr_symbol symbol)
{
    static const char *const words[] = {"parameter", "coordinate", "loop"};
    kmp_text sentence = {0};
    if (p->scope->incomplete)
        return NULL;
    kmp_text_printf(&sentence, "unknown %s '%s'", words[symbol], name);
    if (p->scope->suggest)
        p->scope->suggest(p->scope->user, name, symbol, &sentence);
    return parse_say(p, where, &sentence);
}

/* Reports that the grammar requires `wanted` at p->at. */
const kmp_expr *kmp_parse_wanted(kmp_parser *p, const char *wanted)
{
    kmp_parse_skip_space(p);
    if (*p->at == '\0') /* YAML ends a text at a comma within brackets */
        return kmp_parse_complain(p, p->at, "%s is expected, but the expression ends%s", wanted,
                                  strstr(wanted, "','") ? "; with a comma it needs quotes inside {..} and [..]" : "");
    int length = (int)kmp_parse_word_length(p->at);
    if (length == 0) /* the bytes of a character, so that a message never cuts one */
        do
            length++;
        while (((unsigned char)p->at[length] & 0xc0) == 0x80);
    const bool decimal =
        p->at > p->text && *p->at == ',' && isdigit((unsigned char)p->at[-1]) && isdigit((unsigned char)p->at[1]);
    return kmp_parse_complain(p, p->at, "%s is expected here, not '%.*s'%s", wanted, length, p->at,
                              decimal ? KMP_DECIMAL_POINT : "");
}

/* -- nodes --------------------------------------------------------------------------------------- */

const kmp_expr *kmp_expr_make(kmp_arena *arena, kmp_expr expr)
{
    kmp_expr *node = KMP_ARENA_NEW(arena, kmp_expr, 1);
    if (node)
        *node = expr;
    return node;
}

const kmp_expr *kmp_parse_make(kmp_parser *p, const char *where, kmp_expr expr)
{
    if (++p->nodes > KMP_MOST_EXPRESSION_NODES)
        return kmp_parse_complain(p, p->text, "the expression is too long: more than %d operations and operands",
                                  KMP_MOST_EXPRESSION_NODES);
    expr.column = kmp_parse_column(p, where);
    return kmp_expr_make(p->scope->arena, expr);
}

KMP_NOINLINE static const kmp_expr *make_binary(kmp_parser *p, const char *where, kmp_expr_kind kind, const kmp_expr *a,
                                                const kmp_expr *b)
{
    return a && b ? kmp_parse_make(p, where, (kmp_expr){.kind = kind, .a = a, .b = b}) : NULL;
}

/* -- rules --------------------------------------------------------------------------------------- */

/* a < b and its like. */
static const kmp_expr *parse_comparison(kmp_parser *p)
{
    static const kmp_expr_kind kinds[2][2] = {{KMP_EXPR_LESS, KMP_EXPR_AT_MOST}, {KMP_EXPR_GREATER, KMP_EXPR_AT_LEAST}};
    const kmp_expr *left = kmp_parse_sum(p);
    if (!left)
        return NULL;
    kmp_parse_skip_space(p);
    const char *sign = p->at;
    if (*sign != '<' && *sign != '>')
        return kmp_parse_wanted(p, "an operator, '<', '<=', '>' or '>='");
    bool equal = sign[1] == '=';
    p->at += equal ? 2 : 1;
    return make_binary(p, sign, kinds[*sign == '>'][equal], left, kmp_parse_sum(p));
}

KMP_NOINLINE static const kmp_expr *parse_time(kmp_parser *p, const char *where)
{
    if (!p->scope->time)
        return kmp_parse_complain(p, where, "t is not allowed here: a constant is expected");
    return kmp_parse_make(p, where, (kmp_expr){.kind = KMP_EXPR_TIME});
}

/* A state, where coordinates are allowed. */
KMP_NOINLINE static const kmp_expr *parse_state(kmp_parser *p, const char *where, const char *name, int motion)
{
    if (*p->at == '(')
        return kmp_parse_complain(p, where, "'%s' is a state, not a function", name);
    if (!p->scope->coordinate)
        return kmp_parse_complain(p, where, "state '%s' is not allowed here: %s is expected", name,
                                  kmp_parse_allowed(p->scope));
    return kmp_parse_make(p, where, (kmp_expr){.kind = KMP_EXPR_QD, .index = motion});
}

KMP_NOINLINE static const kmp_expr *make_table(kmp_parser *p, const char *where, const kmp_named_table *table,
                                               const kmp_expr *x, const kmp_expr *y)
{
    return kmp_parse_make(p, where, (kmp_expr){.kind = KMP_EXPR_TABLE, .table = table, .a = x, .b = y});
}

static const kmp_expr *parse_table(kmp_parser *p, const char *where, const kmp_named_table *table)
{
    if (!kmp_parse_take(p, '('))
        return kmp_parse_complain(p, where, "table '%s' needs its argument in parentheses", table->name);
    const kmp_expr *x = kmp_parse_sum(p);
    if (!x)
        return NULL;
    if (table->of_two && !kmp_parse_take(p, ','))
        return kmp_parse_wanted(p, "an operator or ',' and the second argument of the table");
    const kmp_expr *y = table->of_two ? kmp_parse_sum(p) : NULL;
    if (table->of_two && !y)
        return NULL;
    if (!kmp_parse_take(p, ')'))
        return kmp_parse_wanted(p, "an operator or ')'");
    return make_table(p, where, table, x, y);
}

static bool is_implicit(const kmp_expr *expr, const void *unused)
{
    (void)unused;
    return expr->kind == KMP_EXPR_UNKNOWN && expr->unknowns->count > 0;
}

/* True if nothing but time and constants occurs in the expression of a name. */
static bool is_of_time(const kmp_unknowns *u)
{
    if (u->count > 0 || !u->zero[0] || kmp_expr_find_named(u->zero[0], is_implicit, NULL))
        return false;
    for (const kmp_expr *e = u->leaves; e; e = e->kind == KMP_EXPR_ADD ? e->b : NULL) {
        const kmp_expr *leaf = e->kind == KMP_EXPR_ADD ? e->a : e;
        if (leaf->kind != KMP_EXPR_TIME && leaf->kind != KMP_EXPR_INPUT && leaf->kind != KMP_EXPR_PARAMETER)
            return false;
    }
    return true;
}

/* An algebraic variable of the model, where coordinates are allowed; a name of a function of time, where time is. */
KMP_NOINLINE static const kmp_expr *parse_unknown(kmp_parser *p, const char *where, kmp_expr made)
{
    const kmp_unknowns *u = made.unknowns;
    const char *name = u->count ? u->unknown[made.number] : u->name;
    if (*p->at == '(')
        return kmp_parse_complain(p, where, "'%s' is an algebraic variable, not a function", name);
    if (!p->scope->coordinate && !(p->scope->time && is_of_time(u)))
        return kmp_parse_complain(p, where, "%s is not allowed here: %s is expected%s", name,
                                  kmp_parse_allowed(p->scope),
                                  u->count > 0      ? ", and implicit variables are solved with the motion"
                                  : !p->scope->time ? ", without names of 'algebraic': write it out"
                                                    : ", and this name of 'algebraic' depends on more");
    if (u->late && !u->zero[0] && p->scope->incomplete)
        return NULL;
    if (u->late && !u->zero[0])
        return kmp_parse_complain(p, where, "%s depends on multipliers, which is not allowed here", name);
    made.kind = KMP_EXPR_UNKNOWN;
    made.a = u->leaves;
    return kmp_parse_make(p, where, made);
}

/* x, y or z. */
KMP_NOINLINE static const kmp_expr *parse_place(kmp_parser *p, const char *where, int index)
{
    if (index >= p->scope->place)
        return kmp_parse_complain(p, where, "%c is not allowed here: a function of x%s is expected", "xyz"[index],
                                  p -> scope -> place > 1 ? " and y" : "");
    return kmp_parse_make(p, where, (kmp_expr){.kind = KMP_EXPR_PLACE, .index = index});
}

static const kmp_expr_local *find_local(const kmp_parser *p, const char *name)
{
    const kmp_expr_locals *locals = p->scope->locals;
    for (int k = 0; locals && k < locals->count; k++)
        if (locals->local[k].expr && strcmp(locals->local[k].name, name) == 0)
            return &locals->local[k];
    return NULL;
}

/* True if the model has a parameter, an input or a variable of this name. */
static bool is_defined(const kmp_expr_scope *scope, const char *name)
{
    kmp_expr input = {0};
    const kmp_unknowns *unknowns = NULL;
    int number = 0;
    return (scope->parameter && scope->parameter(scope->user, name) >= 0) ||
           (scope->input && scope->input(scope->user, name, &input)) ||
           (scope->state && scope->state(scope->user, name) >= 0) ||
           (scope->unknown && scope->unknown(scope->user, name, &unknowns, &number) >= 0);
}

KMP_NOINLINE static const kmp_expr *parse_local(kmp_parser *p, const char *where, const kmp_expr_local *local)
{
    if (!local->yields && is_defined(p->scope, local->name))
        return kmp_parse_complain(p, where,
                                  "'%s' is a quantity of this force and a name of the model: give the latter another "
                                  "name",
                                  local->name);
    return kmp_parse_make(p, where, *local->expr);
}

KMP_NOINLINE static const kmp_expr *make_number(kmp_parser *p, const char *where, double value, kmp_dimension unit)
{
    if (!isfinite(value))
        return kmp_parse_complain(p, where, "this number is too large: the largest is about 1.8e308 in SI units");
    return kmp_parse_make(p, where, (kmp_expr){.kind = KMP_EXPR_NUMBER, .value = value, .unit = unit});
}

/* A name of the model that is not a function, if it has one. */
KMP_NOINLINE static const kmp_expr *parse_variable(kmp_parser *p, const char *where, const char *name, bool *found)
{
    *found = true;
    int index = p->scope->parameter ? p->scope->parameter(p->scope->user, name) : -1;
    if (index >= 0 && *p->at == '(')
        return kmp_parse_complain(p, where, "'%s' is a parameter, not a function", name);
    if (index >= 0)
        return kmp_parse_make(p, where, (kmp_expr){.kind = KMP_EXPR_PARAMETER, .index = index});
    kmp_expr input = {0};
    if (p->scope->input && p->scope->input(p->scope->user, name, &input)) {
        /* An input, which is a function of time. */
        if (*p->at == '(')
            return kmp_parse_complain(p, where, "'%s' is an input, not a function", name);
        if (!p->scope->time)
            return kmp_parse_complain(p, where, "input '%s' is not allowed here: a constant is expected", name);
        input.kind = KMP_EXPR_INPUT;
        return kmp_parse_make(p, where, input);
    }
    index = p->scope->state ? p->scope->state(p->scope->user, name) : -1;
    if (index >= 0)
        return parse_state(p, where, name, index);
    const kmp_unknowns *unknowns = NULL;
    int number = 0;
    index = p->scope->unknown ? p->scope->unknown(p->scope->user, name, &unknowns, &number) : -1;
    if (index >= 0)
        return parse_unknown(p, where, (kmp_expr){.index = index, .number = number, .unknowns = unknowns});
    *found = false;
    return NULL;
}

/* -- calls of functions ------------------------------------------------------------------------------ */

/* Functions of the expression language: functions with a separate operation, and functions that others are made of. */

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

bool kmp_function_yields(const char *name)
{
    return strcmp(name, kmp_function_name(KMP_FUNCTION_floor)) == 0 ||
           strcmp(name, kmp_function_name(KMP_FUNCTION_wrap)) == 0;
}

/* -- errors ------------------------------------------------------------------------------------------ */

KMP_NOINLINE static const kmp_expr *complain_function(const kmp_parser *p, const char *where, const char *name)
{
    kmp_text sentence = {0};
    kmp_nearest nearest = kmp_nearest_of(name, KMP_NAMES_OF(functions));
    if (p->scope->incomplete)
        return NULL;
    kmp_nearest_offer_all(&nearest, KMP_NAMES_OF(composites));
    kmp_nearest_offer_all(&nearest, kmp_measure_words);
    kmp_text_printf(&sentence, "unknown function '%s'", name);
    kmp_nearest_suggest(&nearest, &sentence);
    return parse_say(p, where, &sentence);
}

/* -- calls ------------------------------------------------------------------------------------------- */

/* The arguments of a function, from the opening parenthesis on: how many, -1 after an error. Names beyond the most
 * are only counted. */
static int parse_arguments(kmp_parser *p, const char *where, const char *name, bool compares,
                           const kmp_expr *arguments[MOST_ARGUMENTS])
{
    int count = 0;
    if (!kmp_parse_take(p, '(')) {
        if (!p->scope->incomplete) /* a parameter may have the name of a function */
            kmp_parse_complain(p, where, "function '%s' needs its argument in parentheses", name);
        return -1;
    }
    if (kmp_parse_take(p, ')'))
        return 0;
    do {
        const kmp_expr *argument = compares && count == 0 ? parse_comparison(p) : kmp_parse_sum(p);
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

/* Degrees are often forgotten in cos(30). */
static void report_turns(kmp_parser *p, const char *where, const char *name, const kmp_expr *argument)
{
    const kmp_expr *literal = argument && argument->kind == KMP_EXPR_NEG ? argument->a : argument;
    if (literal && literal->kind == KMP_EXPR_NUMBER && literal->unit.kind == KMP_DIMENSION_BARE &&
        literal->value > KMP_MORE_TURN)
        p->scope->turns(p->scope->user, name, argument == literal ? literal->value : -literal->value,
                        kmp_parse_column(p, where));
}

/* The call of a function, from the opening parenthesis on. */
static const kmp_expr *parse_call(kmp_parser *p, const char *where, const char *name)
{
    const kmp_expr *arguments[MOST_ARGUMENTS] = {NULL};
    int function = find_function(name), composite = kmp_name_find(KMP_NAMES_OF(composites), name);
    if (composite < 0 && function < 0)
        return complain_function(p, where, name);
    int count = parse_arguments(p, where, name, composite < 0 && function == KMP_FUNCTION_if, arguments);
    int arity = composite < 0 ? functions[function].arity : composites[composite].arity;
    if (count >= 0 && count != arity)
        return kmp_parse_complain(p, where, "function '%s' takes %d argument%s, not %d", name, arity,
                                  arity == 1 ? "" : "s", count);
    const bool jumps = count > 0 && composite < 0 && (function == KMP_FUNCTION_floor || function == KMP_FUNCTION_wrap);
    if (jumps && !p->scope->jumps && !(kmp_expr_is_constant(arguments[0]) && kmp_expr_is_constant(arguments[1])))
        return kmp_parse_complain(p, where,
                                  "'%s' jumps, and only sensors and the next values of states may have it: use a "
                                  "periodic table, whose slope is smooth, or 'if', whose changes are located",
                                  name);
    if (count == 1 && composite < 0 && p->scope->turns &&
        (function == KMP_FUNCTION_sin || function == KMP_FUNCTION_cos || function == KMP_FUNCTION_tan))
        report_turns(p, where, name, arguments[0]);
    return count < 0       ? NULL
           : composite < 0 ? make_call(p, where, function, arguments)
                           : make_composite(p, where, composite, arguments);
}

void kmp_local_put(kmp_expr_locals *locals, const char *name, const kmp_expr *expr)
{
    if (expr && locals->count < KMP_LOCALS_MOST)
        locals->local[locals->count++] = (kmp_expr_local){name, expr, false};
}

const kmp_expr *kmp_expr_formula(kmp_arena *arena, const char *text, const kmp_expr_locals *locals)
{
    const kmp_expr_scope scope = {.arena = arena, .file = "", .locals = locals};
    return kmp_expr_parse(&scope, text);
}

static const kmp_expr *parse_word(kmp_parser *p)
{
    const char *where = p->at;
    const char *name = kmp_parse_copy(p, kmp_parse_name_length(p->at));
    if (!name)
        return NULL;
    if (strcmp(name, "q") == 0)
        return kmp_parse_coordinate(p, where, KMP_EXPR_Q);
    if (strcmp(name, "qd") == 0)
        return kmp_parse_coordinate(p, where, KMP_EXPR_QD);
    if (strcmp(name, "t") == 0)
        return parse_time(p, where);
    if (strcmp(name, "pi") == 0)
        return make_number(p, where, 3.14159265358979323846, (kmp_dimension){0});
    if (p->scope->place > 0 && name[0] >= 'x' && name[0] <= 'z' && !name[1])
        return parse_place(p, where, name[0] - 'x');
    kmp_parse_skip_space(p);
    const kmp_named_table *table = p->scope->table ? p->scope->table(p->scope->user, name) : NULL;
    if (table)
        return parse_table(p, where, table);
    if (*p->at == '(' && kmp_parse_refers(p, name))
        return kmp_parse_reference(p, where, name);
    const kmp_expr_local *local = find_local(p, name);
    if (local && !(local->yields && is_defined(p->scope, name)))
        return parse_local(p, where, local);
    bool found;
    const kmp_expr *variable = parse_variable(p, where, name, &found);
    if (found)
        return variable;
    if (*p->at == '(' || find_function(name) >= 0 || kmp_name_find(KMP_NAMES_OF(composites), name) >= 0)
        return parse_call(p, where, name);
    return kmp_parse_unknown_name(p, where, name, KMP_SYMBOL_PARAMETER);
}

/* `^` and a whole number after a unit. */
static bool parse_unit_power(kmp_parser *p, int *power)
{
    *power = 1;
    if (!kmp_parse_take(p, '^'))
        return true;
    kmp_parse_skip_space(p);
    const char *where = p->at;
    bool negative = kmp_parse_take(p, '-');
    int digit = is_digit(*p->at) ? *p->at - '0' : -1;
    if (digit < 0 || is_digit(p->at[1]) || p->at[1] == '.' || begins_word(p->at[1])) {
        kmp_parse_complain(p, where,
                           "the power of a unit is an integer below ten; write (2 m)^x for a power of the number");
        return false;
    }
    p->at++;
    *power = negative ? -digit : digit;
    return true;
}

/* Multiplies or divides by another unit after `*` or `/`. Returns 1 if there was one, 0 if none, -1 after an error. */
static int parse_next_unit(kmp_parser *p, kmp_unit *unit)
{
    const kmp_expr_scope *scope = p->scope;
    const char *begin = p->at, *word;
    kmp_unit next;
    int power, sign = kmp_parse_take(p, '*') ? 1 : kmp_parse_take(p, '/') ? -1 : 0;
    kmp_parse_skip_space(p);
    word = p->at;
    size_t length = sign ? kmp_parse_word_length(word) : 0;
    const char *after = word + length + strspn(word + length, " \t\r\n");
    if (length == 0 || *after == '(' || !kmp_unit_find(word, length, &next)) {
        p->at = begin;
        return 0;
    }
    const char *name = kmp_parse_copy(p, length);
    if (!name)
        return -1;
    if (is_defined(scope, name) || find_local(p, name)) {
        kmp_parse_complain(p, word,
                           "'%s' is a unit and a name of this model: give the name another one, or, where the name is "
                           "meant, put the number and its unit in parentheses",
                           name);
        return -1;
    }
    if (!parse_unit_power(p, &power))
        return -1;
    kmp_unit_multiply(unit, &next, sign * power);
    return 1;
}

/* A number with the unit that may follow it: one literal. */
KMP_NOINLINE static const kmp_expr *parse_unit(kmp_parser *p, const char *number, double value)
{
    kmp_unit first, unit = {1, 1, KMP_DIM_NUMBER, 0};
    int power, more;
    kmp_parse_skip_space(p);
    size_t length = kmp_parse_word_length(p->at);
    if (length == 0)
        return make_number(p, number, value, (kmp_dimension){0});
    const char *where = p->at, *name = kmp_parse_copy(p, length);
    if (!name)
        return NULL;
    if (!kmp_unit_find(name, length, &first)) {
        kmp_text sentence = {0};
        kmp_text_printf(&sentence, "an operator or a unit is expected here, not '%s'", name);
        kmp_unit_suggest(name, length, &sentence);
        return parse_say(p, where, &sentence);
    }
    if (!parse_unit_power(p, &power))
        return NULL;
    if (p->scope->degrees && strcmp(name, "deg") == 0)
        *p->scope->degrees = true;
    kmp_unit_multiply(&unit, &first, power);
    while ((more = parse_next_unit(p, &unit)) > 0)
        ;
    return more < 0 ? NULL : make_number(p, number, value * unit.factor / unit.divisor, unit.dimension);
}

static const kmp_expr *parse_primary(kmp_parser *p)
{
    double value = 0;
    if (kmp_parse_take(p, '(')) {
        const kmp_expr *inner = kmp_parse_sum(p);
        if (inner && !kmp_parse_take(p, ')'))
            return kmp_parse_wanted(p, "an operator or ')'");
        return inner;
    }
    size_t n = kmp_text_to_number(p->at, &value);
    if (n > 0) {
        const char *number = p->at;
        p->at += n;
        return parse_unit(p, number, value);
    }
    if (begins_word(*p->at))
        return parse_word(p);
    return kmp_parse_wanted(p, "a number, a name or '('");
}

static const kmp_expr *parse_power(kmp_parser *p)
{
    const kmp_expr *base = parse_primary(p);
    if (!base || !kmp_parse_take(p, '^'))
        return base;
    const char *sign = p->at - 1;
    kmp_parse_skip_space(p);
    const char *where = p->at;
    const kmp_expr *exponent = parse_factor(p);
    if (exponent && !kmp_expr_is_constant(exponent))
        return kmp_parse_complain(p, where, "an exponent must be constant: numbers and parameters");
    return make_binary(p, sign, KMP_EXPR_POW, base, exponent);
}

KMP_NOINLINE static const kmp_expr *make_negative(kmp_parser *p, const char *where, const kmp_expr *a)
{
    return a ? kmp_parse_make(p, where, (kmp_expr){.kind = KMP_EXPR_NEG, .a = a}) : NULL;
}

/* Every nested rule passes through this function, which limits the depth. */
static const kmp_expr *parse_factor(kmp_parser *p)
{
    const kmp_expr *factor;
    kmp_parse_skip_space(p);
    if (p->depth >= KMP_MOST_EXPRESSION_LEVELS)
        return kmp_parse_complain(p, p->at, "the expression is nested too deeply: more than %d levels",
                                  KMP_MOST_EXPRESSION_LEVELS);
    p->depth++;
    const char *where = p->at;
    if (kmp_parse_take(p, '-')) {
        factor = make_negative(p, where, parse_factor(p));
    } else {
        factor = parse_power(p);
    }
    p->depth--;
    return factor;
}

static const kmp_expr *parse_product(kmp_parser *p)
{
    const kmp_expr *left = parse_factor(p);
    while (left) {
        kmp_expr_kind kind = kmp_parse_take(p, '*') ? KMP_EXPR_MUL : KMP_EXPR_DIV;
        if (kind == KMP_EXPR_DIV && !kmp_parse_take(p, '/'))
            break;
        const char *sign = p->at - 1;
        left = make_binary(p, sign, kind, left, parse_factor(p));
    }
    return left;
}

const kmp_expr *kmp_parse_sum(kmp_parser *p)
{
    const kmp_expr *left = parse_product(p);
    while (left) {
        kmp_expr_kind kind = kmp_parse_take(p, '+') ? KMP_EXPR_ADD : KMP_EXPR_SUB;
        if (kind == KMP_EXPR_SUB && !kmp_parse_take(p, '-'))
            break;
        const char *sign = p->at - 1;
        left = make_binary(p, sign, kind, left, parse_product(p));
    }
    return left;
}

const kmp_expr *kmp_expr_parse(const kmp_expr_scope *scope, const char *text)
{
    kmp_parser p = {.scope = scope, .text = text, .at = text};
    const kmp_expr *expr = scope->compares ? parse_comparison(&p) : kmp_parse_sum(&p);
    kmp_parse_skip_space(&p);
    if (!expr || *p.at == '\0')
        return expr;
    return kmp_parse_wanted(&p, "an operator or the end");
}
