/* SPDX-License-Identifier: BSD-3-Clause */
/* Words that refer to other parts of the model: coordinates, multipliers, points and their axes. */
#include "model/language/expression_references.h"
#include "model/language/expression.h"
#include "model/language/expression_parser.h"
#include "model/language/expression_value.h"
#include <string.h>

enum { OF_POINT, OF_AXIS, OF_CONTACT, OF_LOOP, OF_JOINT, OF_BEARING, OF_GEAR, OF_ROPE, OF_SHEAVE };

/* Components of the values of bearings. */
enum { OF_BEARINGS = 7, AXIAL = 6 };

static const struct {
    const char *word;
    int of; /* axes, points, contacts, loops, joints, bearings, gears, ropes or sheaves of them */
    int least, most, components, order;
} rows[] = {
#define KMP_MEASURE(kind, word, argument, least, most, components, order, unit, meaning)                               \
    {word, OF_##argument, least, most, components, order},
#include "model/language/measures.def"
#undef KMP_MEASURE
};

const kmp_name_list kmp_measure_words = {rows, sizeof rows[0], sizeof rows / sizeof *rows};

static bool is_digit(char c)
{
    return c >= '0' && c <= '9';
}

/* -- coordinates and multipliers ------------------------------------------------------------------ */

/* The operands allowed where no coordinates are. */
const char *kmp_parse_allowed(const kmp_expr_scope *scope)
{
    return scope->coordinate  ? "a function of q, qd and t"
           : scope->place > 1 ? "a function of x, y, z and t"
           : scope->place     ? "a function of x and t"
           : scope->time      ? "a function of t"
                              : "a constant";
}

/* q(NAME) and qd(NAME), from the opening parenthesis on. */
const kmp_expr *kmp_parse_coordinate(kmp_parser *p, const char *where, kmp_expr_kind kind)
{
    const char *symbol = kind == KMP_EXPR_Q ? "q" : "qd";
    if (!p->scope->coordinate)
        return kmp_parse_complain(p, where, "%s is not allowed here: %s is expected", symbol,
                                  kmp_parse_allowed(p->scope));
    if (!kmp_parse_take(p, '('))
        return kmp_parse_complain(p, where, "'%s' needs a coordinate in parentheses: %s(NAME)", symbol, symbol);
    kmp_parse_skip_space(p);
    const char *start = p->at;
    size_t n = kmp_parse_name_length(start);
    if (n == 0)
        return kmp_parse_wanted(p, "the name of a coordinate");
    if (start[n] == '.' && is_digit(start[n + 1])) /* JOINT.1, or BODY.y1 of a flexible body */
        for (n++; is_digit(start[n]);)
            n++;
    else if (start[n] == '.' && kmp_parse_word_length(start + n + 1) > 0)
        n += 1 + kmp_parse_word_length(start + n + 1);
    const char *name = kmp_parse_copy(p, n);
    int index = name ? p->scope->coordinate(p->scope->user, name) : -1;
    const kmp_expr *cut = name && index < 0 && p->scope->cut ? p->scope->cut(p->scope->user, name) : NULL;
    if (index < 0 && !cut)
        return kmp_parse_unknown_name(p, start, name ? name : "", KMP_SYMBOL_COORDINATE);
    if (!kmp_parse_take(p, ')'))
        return kmp_parse_wanted(p, "')'");
    if (cut)
        return kind == KMP_EXPR_Q ? cut : kmp_parse_make(p, where, (kmp_expr){.kind = KMP_EXPR_RATE, .a = cut});
    return kmp_parse_make(p, where, (kmp_expr){.kind = kind, .index = index});
}

/* The name of a closure: its index, -1 after an error. */
static int parse_closure(kmp_parser *p, const char **name)
{
    kmp_parse_skip_space(p);
    const char *start = p->at;
    size_t n = kmp_parse_name_length(start);
    if (n == 0) {
        kmp_parse_wanted(p, "the name of a loop");
        return -1;
    }
    *name = kmp_parse_copy(p, n);
    int index = *name ? p->scope->closure(p->scope->user, *name) : -1;
    if (index < 0)
        kmp_parse_unknown_name(p, start, *name ? *name : "", KMP_SYMBOL_CLOSURE);
    return index;
}

/* lambda(LOOP) and lambda(LOOP.k), from the opening parenthesis on. */
static const kmp_expr *parse_multiplier(kmp_parser *p, const char *where)
{
    if (!p->scope->closure)
        return kmp_parse_complain(p, where, "lambda is not allowed here: %s is expected", kmp_parse_allowed(p->scope));
    const char *name;
    int number = 0;
    (void)kmp_parse_take(p, '(');
    int index = parse_closure(p, &name);
    if (index < 0)
        return NULL;
    if (*p->at == '.') {
        const char *digit = ++p->at;
        if (!is_digit(*digit) || *digit == '0' || is_digit(digit[1]))
            return kmp_parse_complain(
                p, digit, "the number of a multiplier is expected here: lambda(%s.1) is the first one", name);
        number = *p->at++ - '1';
    }
    if (!kmp_parse_take(p, ')'))
        return kmp_parse_wanted(p, "')'");
    return kmp_parse_make(p, where, (kmp_expr){.kind = KMP_EXPR_LAMBDA, .index = index, .number = number});
}

/* -- measures ---------------------------------------------------------------------------------------- */

/* `.x`, `.y` or `.z`: 0, 1, 2; -1 when none follows. */
static int take_component(kmp_parser *p)
{
    const char *at = p->at;
    if (at[0] != '.' || at[1] < 'x' || at[1] > 'z' || kmp_parse_word_length(at + 1) != 1)
        return -1;
    p->at += 2;
    return at[1] - 'x';
}

/* `.WORD`, which ends there. */
static bool take_part(kmp_parser *p, const char *word)
{
    const size_t length = strlen(word);
    if (p->at[0] != '.' || kmp_parse_word_length(p->at + 1) != length || strncmp(p->at + 1, word, length) != 0)
        return false;
    p->at += 1 + length;
    return true;
}

/* The same, or `.size`: KMP_MEASURE_SIZE. */
static int take_component_or_size(kmp_parser *p)
{
    return take_part(p, "size") ? KMP_MEASURE_SIZE : take_component(p);
}

/* Of bearings: `.1.x`, `.2.size`, `.axial`; the sizes are after all components. */
static int take_bearing_component(kmp_parser *p)
{
    if (take_part(p, "axial"))
        return AXIAL;
    if (p->at[0] != '.' || (p->at[1] != '1' && p->at[1] != '2'))
        return -1;
    const int second = p->at[1] == '2';
    p->at += 2;
    const int component = take_component_or_size(p);
    return component < 0 ? -1 : component == KMP_MEASURE_SIZE ? OF_BEARINGS + second : 3 * second + component;
}

/* BODY.POINT, with axes BODY.POINT.x: false after an error. */
static bool parse_point_or_axis(kmp_parser *p, const char *word, bool axes, kmp_measure_argument *argument)
{
    kmp_parse_skip_space(p);
    const char *start = p->at;
    size_t n = kmp_parse_word_length(start), m = n > 0 && start[n] == '.' ? kmp_parse_word_length(start + n + 1) : 0;
    if (m == 0) {
        kmp_parse_wanted(p, axes ? "an axis BODY.POINT.x" : "a point BODY.POINT");
        return false;
    }
    const char *name = kmp_parse_copy(p, n + 1 + m); /* `port.NAME` has this form, too */
    if (!name || !p->scope->point(p->scope->user, name, word, kmp_parse_column(p, start), argument))
        return false;
    argument->axis = axes ? take_component(p) : -1;
    if (axes && argument->axis < 0)
        kmp_parse_complain(p, p->at, "an axis is expected here: %s.x, %s.y or %s.z", name, name, name);
    return !axes || argument->axis >= 0;
}

static bool parse_contact(kmp_parser *p, const char *word, kmp_measure_argument *argument)
{
    kmp_parse_skip_space(p);
    const char *start = p->at, *name = kmp_parse_copy(p, kmp_parse_word_length(start));
    const char *found = name && p->scope->contact ? p->scope->contact(p->scope->user, name) : NULL;
    *argument = (kmp_measure_argument){.point = -1, .axis = -1, .name = found};
    if (name && !found)
        kmp_parse_complain(p, start, "%s: '%s' is not a contact with a law", word, name);
    return found;
}

/* A pair of gears, or bearings. */
static bool parse_pair(kmp_parser *p, const char *word, bool gears, kmp_measure_argument *argument)
{
    int (*const find)(void *user, const char **name) = gears ? p->scope->gear : p->scope->bearing;
    kmp_parse_skip_space(p);
    const char *start = p->at, *name = kmp_parse_copy(p, kmp_parse_word_length(start));
    const int found = name && find ? find(p->scope->user, &name) : -1;
    *argument = (kmp_measure_argument){.point = -1, .axis = -1, .closure = found, .name = name};
    if (name && found < 0 && !p->scope->incomplete)
        kmp_parse_complain(p, start, gears ? "%s: '%s' is not a pair of gears" : "%s: the model has no bearings '%s'",
                           word, name);
    return found >= 0;
}

/* A rope, or ROPE.k, a place of its path. */
static bool parse_rope(kmp_parser *p, const char *word, bool sheave, kmp_measure_argument *argument)
{
    kmp_parse_skip_space(p);
    const char *start = p->at, *name = kmp_parse_copy(p, kmp_parse_word_length(start));
    int places = 0, closure = -1, place = 0;
    const int found = name && p->scope->rope ? p->scope->rope(p->scope->user, &name, &places, &closure) : -1;
    if (name && found < 0)
        kmp_parse_complain(p, start, "%s: '%s' is not a rope", word, name);
    if (found >= 0 && places == 0) /* its error is reported */
        return false;
    if (found >= 0 && sheave) {
        if (*p->at == '.')
            for (p->at++; is_digit(*p->at) && place <= places; p->at++)
                place = 10 * place + (*p->at - '0');
        if (place < 1 || place > places) {
            kmp_parse_complain(p, start, "%s: a place of rope '%s' is expected, from %s.1 to %s.%d", word, name, name,
                               name, places);
            return false;
        }
        name = kmp_arena_printf(p->scope->arena, "%s.%d", name, place);
    }
    *argument = (kmp_measure_argument){
        .point = -1, .axis = -1, .closure = found, .place = sheave ? place - 1 : closure, .name = name};
    return found >= 0 && name;
}

static bool parse_argument(kmp_parser *p, kmp_measure_kind kind, kmp_measure_argument *argument)
{
    if (rows[kind].of == OF_LOOP) {
        *argument = (kmp_measure_argument){.point = -1, .axis = -1};
        argument->closure = parse_closure(p, &argument->name);
        return argument->closure >= 0;
    }
    if (rows[kind].of == OF_JOINT) {
        kmp_parse_skip_space(p);
        const char *start = p->at, *name = kmp_parse_copy(p, kmp_parse_name_length(start)), *obstacle = NULL;
        int body = name ? p->scope->joint(p->scope->user, &name, &obstacle) : -1;
        *argument = (kmp_measure_argument){.point = -1, .axis = -1, .closure = body, .name = name};
        if (obstacle)
            kmp_parse_complain(p, start, "%s: the load of joint '%s' is not known: %s", rows[kind].word, name,
                               obstacle);
        return body >= 0 && !obstacle;
    }
    if (rows[kind].of == OF_GEAR || rows[kind].of == OF_BEARING)
        return parse_pair(p, rows[kind].word, rows[kind].of == OF_GEAR, argument);
    if (rows[kind].of == OF_ROPE || rows[kind].of == OF_SHEAVE)
        return parse_rope(p, rows[kind].word, rows[kind].of == OF_SHEAVE, argument);
    return rows[kind].of == OF_CONTACT ? parse_contact(p, rows[kind].word, argument)
                                       : parse_point_or_axis(p, rows[kind].word, rows[kind].of == OF_AXIS, argument);
}

/* The component of a vector, or of one of three, after the closing parenthesis. */
static bool parse_component(kmp_parser *p, kmp_measure_kind kind, int *number)
{
    const int count = rows[kind].components;
    const int first = count == OF_BEARINGS ? take_bearing_component(p)
                      : count == 3         ? take_component_or_size(p)
                      : count > 1          ? take_component(p)
                                           : 0;
    const int second = count > OF_BEARINGS && first >= 0 ? take_component(p) : 0;
    *number = count > OF_BEARINGS ? 3 * first + second : first;
    if (first < 0 || second < 0)
        kmp_parse_complain(p, p->at, "a component is expected here: %s(..)%s, for example", rows[kind].word,
                           count > OF_BEARINGS    ? ".z.x"
                           : count == OF_BEARINGS ? ".1.size"
                                                  : ".x");
    return first >= 0 && second >= 0;
}

const kmp_expr *kmp_expr_measure(kmp_arena *arena, kmp_measure_kind kind, int count,
                                 const kmp_measure_argument *argument)
{
    kmp_measure *measure = KMP_ARENA_NEW(arena, kmp_measure, 1);
    if (!measure)
        return NULL;
    *measure =
        (kmp_measure){.kind = kind, .word = rows[kind].word, .components = rows[kind].components, .count = count};
    memcpy(measure->argument, argument, (size_t)count * sizeof *argument);
    return kmp_expr_make(arena, (kmp_expr){.kind = KMP_EXPR_MEASURE, .measure = measure});
}

/* True if the only argument is the name of a coordinate: no point. */
static bool is_coordinate(const char *s)
{
    size_t n = kmp_parse_word_length(s);
    return n > 0 && (s[n] != '.' || is_digit(s[n + 1]));
}

/* The kind for a joint of the tree in place of the kind for a loop of no such name. */
static kmp_measure_kind kind_for(kmp_parser *p, kmp_measure_kind kind)
{
    const char *at = p->at, *obstacle;
    if (rows[kind].of != OF_LOOP || !p->scope->closure || !p->scope->joint)
        return kind;
    (void)kmp_parse_take(p, '(');
    kmp_parse_skip_space(p);
    const char *name = kmp_parse_copy(p, kmp_parse_name_length(p->at));
    p->at = at;
    bool joint =
        name && p->scope->closure(p->scope->user, name) < 0 && p->scope->joint(p->scope->user, &name, &obstacle) >= 0;
    return !joint ? kind : kind == KMP_MEASURE_MOMENT ? KMP_MEASURE_JOINT_MOMENT : KMP_MEASURE_JOINT_REACTION;
}

/* The tension of a rope: a multiplier, or the normal force of its contact. */
static const kmp_expr *make_tension(kmp_parser *p, const char *where, const kmp_measure *measure)
{
    const char *name = measure->argument[0].name;
    const int closure = measure->argument[0].place;
    if (closure == -2) {
        const kmp_measure_argument of = {.point = -1, .axis = -1, .name = name};
        return kmp_expr_measure(p->scope->arena, KMP_MEASURE_NORMAL, 1, &of);
    }
    if (closure == -3)
        return kmp_parse_complain(p, where, "tension of rope '%s' is its 'force': an expression has that law", name);
    if (closure < 0 || !p->scope->closure)
        return kmp_parse_complain(p, where,
                                  "tension of rope '%s' is not allowed here: of an inextensible rope it is a "
                                  "multiplier, for sensors, 'until' and, with 'slack: no', laws of forces",
                                  name);
    return kmp_parse_make(p, where, (kmp_expr){.kind = KMP_EXPR_LAMBDA, .index = closure});
}

static const kmp_expr *parse_measure(kmp_parser *p, const char *where, kmp_measure_kind kind)
{
    const char *word = rows[kind].word;
    kind = kind_for(p, kind);
    bool of_loop = rows[kind].of == OF_LOOP;
    if (of_loop ? !p->scope->closure : !p->scope->point)
        return kmp_parse_complain(p, where, "%s is not allowed here: %s is expected", word,
                                  kmp_parse_allowed(p->scope));
    if (rows[kind].of == OF_JOINT && !p->scope->accelerations)
        return kmp_parse_complain(p, where,
                                  "%s of a joint of the tree is not allowed here, because it depends on the "
                                  "accelerations: a sensor may use it, 'until' of the run, and friction by 'mu'",
                                  word);
    if (rows[kind].order > 1 && !p->scope->accelerations)
        return kmp_parse_complain(p, where,
                                  "%s is not allowed here: it follows from the forces; a sensor may have it, or a "
                                  "condition 'until' of the run",
                                  word);
    if (kind == KMP_MEASURE_ANGLE && is_coordinate(p->at + 1 + strspn(p->at + 1, " ")))
        return kmp_parse_coordinate(p, where, KMP_EXPR_Q);
    kmp_measure *measure = KMP_ARENA_NEW(p->scope->arena, kmp_measure, 1);
    int number = 0;
    if (!measure)
        return NULL;
    *measure = (kmp_measure){.kind = kind, .word = word, .components = rows[kind].components};
    (void)kmp_parse_take(p, '(');
    do {
        if (measure->count == rows[kind].most)
            return kmp_parse_wanted(p, "')'");
        if (!parse_argument(p, kind, &measure->argument[measure->count++]))
            return NULL;
    } while (kmp_parse_take(p, ','));
    if (measure->count < rows[kind].least)
        return kmp_parse_wanted(p, rows[kind].of == OF_AXIS ? "',' and another axis" : "',' and another point");
    if (!kmp_parse_take(p, ')'))
        return kmp_parse_wanted(p, measure->count < rows[kind].most ? "',' or ')'" : "')'");
    if (!parse_component(p, kind, &number))
        return NULL;
    if (kind == KMP_MEASURE_TENSION)
        return make_tension(p, where, measure);
    if (kind == KMP_MEASURE_DISTANCE && measure->argument[0].point == measure->argument[1].point)
        return kmp_parse_complain(p, where, "distance of the point %s from itself", measure->argument[0].name);
    const kmp_measure_argument *of = measure->argument;
    if (rows[kind].of == OF_POINT && rows[kind].order > 0 && measure->count == 2 && of[0].frame > 0 &&
        of[0].frame == of[1].frame)
        return kmp_parse_complain(p, where,
                                  "%s is always zero between %s and %s, points of one body; with one point it is "
                                  "relative to the ground, in ground axes",
                                  word, of[0].name, of[1].name);
    return kmp_parse_make(p, where,
                          (kmp_expr){.kind = of_loop ? KMP_EXPR_LAMBDA : KMP_EXPR_MEASURE,
                                     .index = of_loop ? measure->argument[0].closure : 0,
                                     .number = number,
                                     .measure = measure});
}

/* -- rates ------------------------------------------------------------------------------------------- */

bool kmp_expr_is_rate(const kmp_expr *expr, const void *unused)
{
    (void)unused;
    return expr->kind == KMP_EXPR_QD || expr->kind == KMP_EXPR_RATE ||
           (expr->kind == KMP_EXPR_MEASURE && rows[expr->measure->kind].order > 0);
}

static bool is_acceleration(const kmp_expr *expr, const void *unused)
{
    (void)unused;
    return expr->kind == KMP_EXPR_MEASURE && rows[expr->measure->kind].order > 1;
}

const kmp_expr *kmp_expr_acceleration(const kmp_expr *expr)
{
    return kmp_expr_find(expr, is_acceleration, NULL);
}

const kmp_expr *kmp_expr_rate(kmp_arena *arena, const kmp_expr *of)
{
    return kmp_expr_make(arena, (kmp_expr){.kind = KMP_EXPR_RATE, .a = of});
}

/* True for what has no separate rate here: rates, multipliers, variables whose equations are being read. */
static bool has_no_rate(const kmp_expr *expr, const void *unused)
{
    const kmp_unknowns *u = expr->unknowns;
    return kmp_expr_is_rate(expr, unused) || expr->kind == KMP_EXPR_LAMBDA ||
           (expr->kind == KMP_EXPR_UNKNOWN && u->count > 0 && !u->zero[u->count - 1]);
}

static const kmp_expr *parse_rate(kmp_parser *p, const char *where)
{
    if (!p->scope->point)
        return kmp_parse_complain(p, where, "rate is not allowed here: %s is expected", kmp_parse_allowed(p->scope));
    (void)kmp_parse_take(p, '(');
    kmp_parse_skip_space(p);
    const char *start = p->at;
    const kmp_expr *of = kmp_parse_sum(p);
    if (!of)
        return NULL;
    if (!kmp_parse_take(p, ')'))
        return kmp_parse_wanted(p, "an operator or ')'");
    if (kmp_expr_find(of, has_no_rate, NULL))
        return kmp_parse_complain(p, start,
                                  "the rate of this expression depends on accelerations: rate(..) is for functions of "
                                  "t, q(..), positions, distances and angles");
    return kmp_parse_make(p, where, (kmp_expr){.kind = KMP_EXPR_RATE, .a = of});
}

/* -- all of them --------------------------------------------------------------------------------------- */

/* `wrap(ROPE.k)`: the function of this name has two arguments. */
static bool is_place(const char *s)
{
    s += strspn(s, "( ");
    s += kmp_parse_word_length(s);
    if (*s != '.' || !is_digit(s[1]))
        return false;
    for (s++; is_digit(*s);)
        s++;
    return s[strspn(s, " ")] == ')';
}

bool kmp_parse_refers(const kmp_parser *p, const char *name)
{
    if (strcmp(name, rows[KMP_MEASURE_WRAP].word) == 0)
        return is_place(p->at);
    return strcmp(name, "lambda") == 0 || strcmp(name, "rate") == 0 || kmp_name_find(kmp_measure_words, name) >= 0;
}

const kmp_expr *kmp_parse_reference(kmp_parser *p, const char *where, const char *name)
{
    if (strcmp(name, "lambda") == 0)
        return parse_multiplier(p, where);
    if (strcmp(name, "rate") == 0)
        return parse_rate(p, where);
    return parse_measure(p, where, (kmp_measure_kind)kmp_name_find(kmp_measure_words, name));
}
