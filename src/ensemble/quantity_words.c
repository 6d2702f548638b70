/* SPDX-License-Identifier: BSD-3-Clause */
/* A quantity is [NAME =] WORD(EXPRESSION) [from TIME] [to TIME], or only an expression: its value at the end. */
#include "ensemble/quantity_words.h"
#include "base/clones.h"
#include "base/memory.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include "model/language/expression.h"
#include "model/language/expression_dimension.h"
#include "model/language/expression_references.h"
#include "model/language/expression_value.h"
#include "model/language/nearest.h"
#include "model/read/loads.h"
#include "model/read/read_values.h"
#include "model/read/reading.h"
#include "model/read/requests.h"
#include "output/reactions.h"
#include "symbolic/table_function.h"
#include <ctype.h>
#include <math.h>
#include <string.h>

typedef struct kmp_added_value {
    const char *text;
    int column;     /* of its first character, in messages */
    bool condition; /* the text is a comparison: the value is negative where it holds */
    /* found: */
    bool or_equal;    /* a condition that holds at zero too */
    bool rates, late; /* it depends on rates; on accelerations or multipliers */
    bool loads;       /* on multipliers */
    int shown;        /* its number among the computed outputs of the copy (kmp_eval_shown), or -1 - a coordinate's
                       * number among q, qd and qdd */
    const char *unit; /* SI, in the copy's arena */
} kmp_added_value;

/* An argument of a function within the values (model/language/expression.h). */
typedef struct kmp_added_argument {
    kmp_argument_kind kind;
    int of;    /* the value that it belongs to */
    int shown; /* as of a value */
} kmp_added_argument;

typedef struct kmp_added_arguments {
    int count;
    kmp_added_argument *of; /* in the copy's arena */
    int outputs;            /* of them, the last ones of the copy */
    bool turns;             /* some value is a wave of the angles of the mechanism, as positions and loads are */
} kmp_added_arguments;

/* -- arguments of functions --------------------------------------------------------------------------------- */

/* Functions of an expression that may change between points at which they are sampled, however smooth what they are
 * taken of is: sin(1000 q), exp(-(q/w)^2), max(0, 1 - abs(q)/w), a table of many points. Each is listed with its
 * argument, in a unit in which the function is smooth over 1. */

typedef struct listing {
    kmp_arena *arena;
    kmp_expr_argument *first;
    bool failed;
} listing;

KMP_NOINLINE static const kmp_expr *node(listing *l, kmp_expr e)
{
    const kmp_expr *made = kmp_expr_make(l->arena, e);
    l->failed = l->failed || !made;
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

static void list_function(listing *l, const kmp_expr *in, kmp_argument_kind kind, const kmp_expr *argument)
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
        list_function(l, e, KMP_ARGUMENT_PEAK, of_two(l, KMP_EXPR_MUL, e->b, log_of(l, e->a)));
}

KMP_NOINLINE static void add_table(listing *l, const kmp_expr *e)
{
    const kmp_named_table *t = e->table;
    const kmp_expr *const argument[] = {e->a, e->b};
    for (int k = 0; k < (t->of_two ? 2 : 1); k++) {
        int count = t->of_two ? t->surface->count[k] : t->table->count;
        const double *x = t->of_two ? t->surface->knot[k] : t->table->x;
        if (count > 1 && !kmp_expr_is_constant(argument[k]))
            list_function(l, e, KMP_ARGUMENT_WAVE, times(l, (count - 1) / (x[count - 1] - x[0]), argument[k]));
    }
}

KMP_NOINLINE static void add_call(listing *l, const kmp_expr *e)
{
    switch (e->function) {
    case KMP_FUNCTION_sin:
    case KMP_FUNCTION_cos:
        list_function(l, e, KMP_ARGUMENT_WAVE, e->a);
        break;
    case KMP_FUNCTION_tan:
        list_function(l, e, KMP_ARGUMENT_WAVE, times(l, 2, e->a));
        break;
    case KMP_FUNCTION_exp:
        list_function(l, e, KMP_ARGUMENT_PEAK, e->a);
        break;
    case KMP_FUNCTION_sinh:
    case KMP_FUNCTION_cosh:
        list_function(l, e, KMP_ARGUMENT_PEAK, call(l, KMP_FUNCTION_abs, e->a));
        break;
    case KMP_FUNCTION_asin:
    case KMP_FUNCTION_acos:
    case KMP_FUNCTION_atan:
    case KMP_FUNCTION_tanh:
        list_function(l, e, KMP_ARGUMENT_STEP, e->a);
        break;
    case KMP_FUNCTION_log:
        list_function(l, e, KMP_ARGUMENT_STEP, log_of(l, e->a));
        break;
    case KMP_FUNCTION_pow:
        add_power(l, e);
        break;
    case KMP_FUNCTION_abs:
        list_function(l, e, KMP_ARGUMENT_SIZE, e->a);
        break;
    case KMP_FUNCTION_floor:
        list_function(l, e, KMP_ARGUMENT_WAVE, times(l, 2 * 3.14159265358979323846, e->a));
        break;
    case KMP_FUNCTION_wrap:
        list_function(l, e, KMP_ARGUMENT_WAVE,
                      times(l, 2 * 3.14159265358979323846, of_two(l, KMP_EXPR_DIV, e->a, e->b)));
        break;
    case KMP_FUNCTION_sign:
        list_function(l, e, KMP_ARGUMENT_KINK, e->a);
        break;
    case KMP_FUNCTION_min:
    case KMP_FUNCTION_max:
        list_function(l, e, KMP_ARGUMENT_KINK, of_two(l, KMP_EXPR_SUB, e->a, e->b));
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
        list_function(l, e, KMP_ARGUMENT_KINK, of_two(l, KMP_EXPR_SUB, e->a, e->b));
        break;
    case KMP_EXPR_DIV:
        if (!kmp_expr_is_constant(e->b))
            list_function(l, e, KMP_ARGUMENT_PEAK, node(l, (kmp_expr){.kind = KMP_EXPR_NEG, .a = log_of(l, e->b)}));
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

/* -- values at a state -------------------------------------------------------------------------------------- */

/* Expressions become sensors of the copy, read by the functions of the file's reader. Parameters have no known
 * dimensions after reading: an expression with one fits any dimension. */

/* A reader of one text on a copy of a model. */
typedef struct adding {
    kmp_reader r;
    const char *label[1];
    const char **files;
    int file_count;
    kmp_expr_locals locals; /* the sensors of the model, by name */
} adding;

static kempe_status begin(adding *a, kempe_model *copy, const char *label)
{
    int count = copy->parameter_count;
    *a = (adding){.label = {label}, .files = copy->source.files, .file_count = copy->source.file_count};
    a->r = (kmp_reader){.context = copy->context, .model = copy, .file = label, .locals = &a->locals};
    copy->source.files = a->label;
    copy->source.file_count = 1;
    a->r.parameter_known = KMP_ARENA_NEW(&a->r.scratch, bool, count);
    a->r.parameter_values = KMP_ARENA_NEW(&a->r.scratch, double, count);
    a->r.parameter_dimensions = KMP_ARENA_NEW(&a->r.scratch, kmp_dimension, count);
    for (int k = 0; k < count && !a->r.scratch.failed; k++) {
        a->r.parameter_known[k] = true;
        a->r.parameter_values[k] = copy->parameters[k].number.value;
        a->r.parameter_dimensions[k] = KMP_DIM_ANY;
    }
    for (int k = 0; k < copy->sensor_count && k < KMP_LOCALS_MOST; k++)
        a->locals.local[a->locals.count++] = (kmp_expr_local){copy->sensors[k].name, copy->sensors[k].expr, true};
    return KEMPE_OK;
}

static kempe_status end(adding *a)
{
    kempe_model *copy = a->r.model;
    bool ok = !a->r.scratch.failed && !copy->arena.failed;
    copy->source.files = a->files;
    copy->source.file_count = a->file_count;
    kmp_arena_free(&a->r.scratch);
    return !ok ? kmp_fail_memory(copy->context) : a->r.wrong ? KEMPE_E_ARGUMENT : KEMPE_OK;
}

static kmp_yaml node_of(const char *text, int column)
{
    const kmp_place place = {1, column, 0};
    return (kmp_yaml){.kind = KMP_YAML_SCALAR, .place = place, .text_place = place, .text = text, .empty = !*text};
}

/* -- outputs ----------------------------------------------------------------------------------------- */

/* True if a text is an output that no expression can be. */
static bool is_output(const char *text)
{
    static const kmp_output_kind kinds[] = {KMP_OUTPUT_FORCE,
                                            KMP_OUTPUT_GAP,
                                            KMP_OUTPUT_ENERGY,
                                            KMP_OUTPUT_MOMENTUM,
                                            KMP_OUTPUT_CONTACT,
                                            KMP_OUTPUT_GUIDANCE,
                                            KMP_OUTPUT_TYRE_CONTACT,
                                            KMP_OUTPUT_POSE,
                                            KMP_OUTPUT_ANGULAR_MOMENTUM,
                                            KMP_OUTPUT_CUT_QDD,
                                            KMP_OUTPUT_PRESSURE_ANGLE,
                                            KMP_OUTPUT_CURVATURE};
    size_t length = strcspn(text, "(.");
    for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
        const char *word = kmp_output_rows[kinds[k]].word;
        if (strlen(word) == length && strncmp(text, word, length) == 0)
            return true;
    }
    return false;
}

/* The unit of a component, from the row of its output. */
static kempe_status add_output(kempe_model *copy, const char *label, kmp_added_value *v, kmp_output *output, int *part)
{
    unsigned *parts = NULL;
    KMP_TRY(kmp_requested_outputs_at(copy, label, (kmp_place){1, v->column, 0}, v->text, &parts));
    int width = copy->output_count == 1 ? kmp_output_width(copy, copy->outputs) : 0;
    *part = 0;
    while (width > 1 && *part < width && parts[0] != 1u << *part)
        ++*part;
    if (width == 0 || *part >= width)
        return kmp_fail(copy->context, KEMPE_E_ARGUMENT, "%s:1:%d: '%s' is not one number: give one component of it",
                        label, v->column, v->text);
    *output = copy->outputs[0];
    v->rates = true;
    v->unit = kmp_output_unit(copy, output, *part);
    v->late = output->kind != KMP_OUTPUT_ENERGY && output->kind != KMP_OUTPUT_MOMENTUM &&
              output->kind != KMP_OUTPUT_ANGULAR_MOMENTUM && output->kind != KMP_OUTPUT_GAP &&
              output->kind != KMP_OUTPUT_OUTLINE_GAP;
    v->loads = kmp_output_has_loads(copy, output);
    return KEMPE_OK;
}

/* -- expressions ------------------------------------------------------------------------------------- */

/* The unit of an expression: of a coordinate or a measure its own, otherwise by its dimension. */
static const char *unit_of_expression(kempe_model *copy, adding *a, const kmp_expr *e)
{
    static const char *const units[] = {
#define KMP_MEASURE(kind, word, argument, least, most, components, order, unit, ...) unit,
#include "model/language/measures.def"
#undef KMP_MEASURE
    };
    bool coordinate = e->kind == KMP_EXPR_Q || (e->kind == KMP_EXPR_QD && e->index < kmp_model_coordinates(copy));
    if (coordinate) {
        bool turns = copy->motions[e->index].rotation;
        return e->kind == KMP_EXPR_Q ? (turns ? "rad" : "m") : turns ? "rad/s" : "m/s";
    }
    if (e->kind == KMP_EXPR_MEASURE || (e->kind == KMP_EXPR_LAMBDA && e->measure))
        return units[e->measure->kind];
    kmp_text text = {0};
    kmp_expr_fault fault = {0};
    kmp_dimension d = kmp_expr_dimension(e, a->r.parameter_dimensions, a->r.parameter_values, &fault);
    kmp_dimension_put_unit(&text, d);
    return kmp_text_keep(&text, &copy->arena);
}

static const kmp_expr *difference_of(kempe_model *copy, const kmp_expr *e, bool *or_equal)
{
    bool less = e->kind == KMP_EXPR_LESS || e->kind == KMP_EXPR_AT_MOST;
    *or_equal = e->kind == KMP_EXPR_AT_MOST || e->kind == KMP_EXPR_AT_LEAST;
    return kmp_expr_make(
        &copy->arena,
        (kmp_expr){.kind = KMP_EXPR_SUB, .a = less ? e->a : e->b, .b = less ? e->b : e->a, .column = e->column});
}

static bool is_measure(const kmp_expr *e, const void *unused)
{
    (void)unused;
    return e->kind == KMP_EXPR_MEASURE;
}

static bool is_unknown(const kmp_expr *e, const void *unused)
{
    (void)unused;
    return e->kind == KMP_EXPR_UNKNOWN;
}

static kempe_status add_expression(kempe_model *copy, const char *label, kmp_added_value *v, kmp_sensor *sensor)
{
    adding a;
    KMP_TRY(begin(&a, copy, label));
    const kmp_yaml node = node_of(v->text, v->column);
    int known = v->condition ? -1 : kmp_name_find(KMP_NAMED(copy, sensor), v->text);
    const kmp_expr *e = known >= 0 ? copy->sensors[known].expr
                                   : kmp_read_expr(&a.r, &node, v->condition ? "a condition" : "a quantity",
                                                   KMP_DIM_ANY, v->condition ? KMP_COMPARISON : KMP_OF_MOTION);
    if (e && v->condition)
        e = difference_of(copy, e, &v->or_equal);
    if (e) {
        v->unit = v->condition ? "" : unit_of_expression(copy, &a, e);
        v->loads = kmp_expr_lambda(e);
        v->late = v->loads || kmp_expr_acceleration(e);
        v->rates = v->late || kmp_expr_find(e, kmp_expr_is_rate, NULL) || kmp_expr_find(e, is_unknown, NULL);
        *sensor = (kmp_sensor){.name = v->text, .expr = e};
    }
    return end(&a);
}

/* -- all --------------------------------------------------------------------------------------------- */

/* The coordinate of "qdd(NAME)", which expressions do not have; -1: it is something else. */
static int acceleration_of(const kempe_model *copy, const char *text, kmp_arena *arena)
{
    size_t length = strlen(text);
    if (strncmp(text, "qdd(", 4) != 0 || text[length - 1] != ')')
        return -1;
    const char *name = kmp_arena_printf(arena, "%.*s", (int)length - 5, text + 4);
    return name ? kmp_name_find(KMP_COORDINATES(copy), name) : -1;
}

/* A coordinate, its rate or its acceleration is in every row. */
static bool is_in_rows(kempe_model *copy, kmp_added_value *v, const kmp_expr *e, int n)
{
    int acceleration = e ? -1 : acceleration_of(copy, v->text, &copy->arena);
    bool state = e && (e->kind == KMP_EXPR_Q || e->kind == KMP_EXPR_QD);
    if (acceleration >= 0)
        v->unit = copy->motions[acceleration].rotation ? "rad/s^2" : "m/s^2";
    if (acceleration >= 0)
        v->late = true;
    if (!state && acceleration < 0)
        return false;
    v->rates = v->late || e->kind == KMP_EXPR_QD;
    v->shown = -1 - (acceleration >= 0 ? 2 * n + acceleration : e->kind == KMP_EXPR_Q ? e->index : n + e->index);
    return true;
}

/* The values as they are read, and the outputs that the copy gets. */
typedef struct making {
    kempe_model *copy;
    kmp_sensor *read;               /* of each value that is an expression */
    const kmp_expr_argument **list; /* of each value */
    bool turns;                     /* some value depends on positions or loads */
    int known;                      /* arguments in all lists */
    kmp_output *output;
    kmp_sensor *sensor;
    int outputs, sensors, place;
} making;

static kempe_status read_value(making *m, const char *label, int k, kmp_added_value *v)
{
    int n = m->copy->motion_count;
    if (!v->condition && is_in_rows(m->copy, v, NULL, n))
        return KEMPE_OK;
    m->turns = m->turns || (!v->condition && is_output(v->text));
    if (!v->condition && is_output(v->text))
        return KEMPE_OK;
    KMP_TRY(add_expression(m->copy, label, v, &m->read[k]));
    if (is_in_rows(m->copy, v, m->read[k].expr, n))
        return KEMPE_OK;
    m->turns = m->turns || v->late || kmp_expr_find(m->read[k].expr, is_measure, NULL);
    listing l = {.arena = &m->copy->arena}; /* of the functions that are not polynomials */
    visit(&l, m->read[k].expr);
    m->list[k] = l.first;
    for (const kmp_expr_argument *a = m->list[k]; a; a = a->next)
        m->known++;
    return kmp_made(m->copy->context, !l.failed);
}

/* Makes an expression an output, unless it is in every row; its number as in kmp_added_value. */
static int place_expression(making *m, const char *name, const kmp_expr *e)
{
    kmp_added_value row = {.text = "?"};
    if (is_in_rows(m->copy, &row, e, m->copy->motion_count))
        return row.shown;
    m->sensor[m->sensors] = (kmp_sensor){.name = name, .expr = e};
    m->output[m->outputs++] = (kmp_output){.kind = KMP_OUTPUT_SENSOR, .index = m->sensors++};
    return m->place++;
}

static kempe_status place_value(making *m, const char *label, int k, kmp_added_value *v)
{
    int part = 0;
    if (v->shown < 0)
        return KEMPE_OK;
    if (m->read[k].expr) {
        v->shown = place_expression(m, v->text, m->read[k].expr);
        return KEMPE_OK;
    }
    KMP_TRY(add_output(m->copy, label, v, &m->output[m->outputs], &part));
    v->shown = m->place + part;
    m->place += kmp_output_width(m->copy, &m->output[m->outputs++]);
    return KEMPE_OK;
}

/* Makes the values, and the arguments of their functions behind them, the outputs of a copy of a model
 * (model/data/variant.h). KEMPE_E_ARGUMENT: sentences that begin with `label` and a column. */
static kempe_status add_values(kempe_model *copy, const char *label, int count, kmp_added_value *values,
                               kmp_added_arguments *arguments)
{
    making m = {.copy = copy, .sensors = copy->sensor_count};
    kmp_arena *arena = &copy->arena;
    *arguments = (kmp_added_arguments){0};
    m.read = KMP_ARENA_NEW(arena, kmp_sensor, count);
    m.list = KMP_ARENA_NEW(arena, const kmp_expr_argument *, count);
    KMP_TRY(kmp_made(copy->context, m.read && m.list));
    for (int k = 0; k < count; k++)
        KMP_TRY(read_value(&m, label, k, &values[k]));
    m.output = KMP_ARENA_NEW(arena, kmp_output, count + m.known);
    m.sensor = KMP_ARENA_NEW(arena, kmp_sensor, m.sensors + count + m.known);
    arguments->of = KMP_ARENA_NEW(arena, kmp_added_argument, m.known);
    KMP_TRY(kmp_made(copy->context, m.output && m.sensor && arguments->of));
    if (m.sensors > 0)
        memcpy(m.sensor, copy->sensors, (size_t)m.sensors * sizeof *m.sensor);
    for (int k = 0; k < count; k++)
        KMP_TRY(place_value(&m, label, k, &values[k]));
    int own = m.outputs;
    for (int k = 0; k < count; k++)
        for (const kmp_expr_argument *a = m.list[k]; a; a = a->next) {
            int shown = place_expression(&m, values[k].text, a->of);
            arguments->of[arguments->count++] = (kmp_added_argument){a->kind, k, shown};
        }
    arguments->outputs = m.outputs - own;
    arguments->turns = m.turns;
    copy->sensors = m.sensor;
    copy->sensor_count = m.sensors;
    copy->outputs = m.output;
    copy->output_count = m.outputs;
    return KEMPE_OK;
}

/* A number of parameters with a dimension, such as a time, read as in the file. KEMPE_E_ARGUMENT as above. */
static kempe_status added_number(kempe_model *copy, const char *label, const char *text, int column, const char *what,
                                 kmp_dimension dimension, double *number)
{
    adding a;
    KMP_TRY(begin(&a, copy, label));
    const kmp_yaml node = node_of(text, column);
    if (kmp_read_fixed(&a.r, &node, what, dimension, number))
        kmp_warn_of_turns(&a.r);
    return end(&a);
}

/* -- words of quantities ------------------------------------------------------------------------------------ */

/* The words of quantities: the number of arguments, and whether the first one is a condition. */
static const struct {
    const char *word;
    kmp_run_quantity_kind kind;
    int arguments;
    bool condition;
} words[] = {{"max", KMP_TAKE_MAX, 1, false},     {"min", KMP_TAKE_MIN, 1, false},
             {"range", KMP_TAKE_RANGE, 1, false}, {"mean", KMP_TAKE_MEAN, 1, false},
             {"rms", KMP_TAKE_RMS, 1, false},     {"integral", KMP_TAKE_INTEGRAL, 1, false},
             {"at", KMP_TAKE_AT, 2, false},       {"first", KMP_TAKE_FIRST, 1, true},
             {"count", KMP_TAKE_COUNT, 1, true},  {"duration", KMP_TAKE_DURATION, 1, true}};

/* A part of a text; column: of its first character, from 1. */
typedef struct part {
    const char *s;
    size_t length;
    int column;
} part;

/* Lists under construction. */
typedef struct reading {
    kmp_quantity_list *list;
    kempe_context *context;
    kempe_model *copy;
    const char *label;
    kmp_run_quantity *of;
    kmp_added_value *channel;
    const char **name, **unit;
    int *shown;
    part *bound;            /* of limits */
    const char **loaded[2]; /* joints with a force, with a moment */
    int loaded_count[2];
} reading;

/* -- parts of texts ----------------------------------------------------------------------------------- */

/* Without spaces around it. */
static part part_of(part whole, size_t from, size_t length)
{
    part p = {whole.s + from, length, whole.column + (int)from};
    for (; p.length > 0 && isspace((unsigned char)*p.s); p.s++, p.length--)
        p.column++;
    while (p.length > 0 && isspace((unsigned char)p.s[p.length - 1]))
        p.length--;
    return p;
}

/* The first of `signs` outside parentheses; the length of the part: there is none. */
static size_t find_outside(part p, const char *signs)
{
    int depth = 0;
    for (size_t k = 0; k < p.length; k++) {
        depth += (p.s[k] == '(') - (p.s[k] == ')');
        if (depth == 0 && strchr(signs, p.s[k]))
            return k;
    }
    return p.length;
}

/* Takes the next item of a list, whose separators are outside parentheses; false after the last one. */
static bool next_item(part *rest, part *item)
{
    while (rest->length > 0) {
        size_t end = find_outside(*rest, ",;\n"), skip = end < rest->length ? end + 1 : end;
        *item = part_of(*rest, 0, end);
        *rest = (part){rest->s + skip, rest->length - skip, rest->column + (int)skip};
        if (item->length > 0)
            return true;
    }
    return false;
}

static part whole_of(const char *text)
{
    return (part){text, text ? strlen(text) : 0, 1};
}

/* Words for the loads of all joints, and the measure of each. */
static const struct {
    const char *all, *one;
} loads_words[2] = {{"(reactions)", "reaction"}, {"(moments)", "moment"}};

/* The place of such a word in an item, and which it is; the length of the item: there is none. */
static size_t find_loads(part item, int *which)
{
    for (*which = 0; *which < 2; ++*which) {
        const size_t length = strlen(loads_words[*which].all);
        for (size_t k = 0; k + length <= item.length; k++)
            if (strncmp(item.s + k, loads_words[*which].all, length) == 0)
                return k;
    }
    return item.length;
}

/* The items of a list, each load of all joints as one of each joint. */
static int count_items(const reading *r, const char *text)
{
    part rest = whole_of(text), item;
    int count = 0, which;
    while (next_item(&rest, &item))
        count += find_loads(item, &which) < item.length ? r->loaded_count[which] : 1;
    return count;
}

static const char *copy_of(reading *r, part p)
{
    return kmp_arena_printf(&r->list->arena, "%.*s", (int)p.length, p.s);
}

static kempe_status complain(const reading *r, part p, const char *sentence)
{
    return kmp_fail(r->context, KEMPE_E_ARGUMENT, "%s:1:%d: '%.*s': %s", r->label, p.column, (int)p.length, p.s,
                    sentence);
}

/* Hands max(reactions) to `add` as max(reaction(JOINT).size) of each joint. */
static kempe_status add_each_load(reading *r, part item, size_t place, int which,
                                  kempe_status (*add)(reading *r, part item))
{
    const size_t end = place + strlen(loads_words[which].all);
    if (memchr(item.s, '=', place))
        return complain(r, item, "it has a value of each joint: leave out the name");
    if (r->loaded_count[which] == 0)
        return complain(r, item, "the model has no joint whose load is known");
    for (int k = 0; k < r->loaded_count[which]; k++) {
        const char *one =
            kmp_arena_printf(&r->list->arena, "%.*s(%s(%s).size)%.*s", (int)place, item.s, loads_words[which].one,
                             r->loaded[which][k], (int)(item.length - end), item.s + end);
        KMP_TRY(kmp_made(r->context, one));
        KMP_TRY(add(r, (part){one, strlen(one), item.column}));
    }
    return KEMPE_OK;
}

/* Hands each item of a list to `add`; `label` names the list in messages. */
static kempe_status each_item(reading *r, const char *text, const char *label,
                              kempe_status (*add)(reading *r, part item))
{
    part rest = whole_of(text), item;
    int which;
    r->label = label;
    while (next_item(&rest, &item)) {
        const size_t place = find_loads(item, &which);
        KMP_TRY(place < item.length ? add_each_load(r, item, place, which, add) : add(r, item));
    }
    return KEMPE_OK;
}

/* -- quantities --------------------------------------------------------------------------------------- */

/* Splits "NAME = REST": an equals sign that is not part of a comparison. */
static part take_name(part *item)
{
    size_t n = 0;
    while (n < item->length && (isalnum((unsigned char)item->s[n]) || strchr("_.-", item->s[n])))
        n++;
    part name = part_of(*item, 0, n);
    while (n < item->length && item->s[n] == ' ')
        n++;
    if (name.length == 0 || n >= item->length || item->s[n] != '=')
        return *item;
    *item = part_of(*item, n + 1, item->length - n - 1);
    return name;
}

/* The row of words that an item begins with, and its arguments; -1: it is an expression. */
static int find_word(part item, part *inside)
{
    const int count = (int)(sizeof words / sizeof *words);
    size_t open = 0;
    while (open < item.length && isalpha((unsigned char)item.s[open]))
        open++;
    if (open == item.length || item.s[open] != '(' || item.s[item.length - 1] != ')')
        return -1;
    const part behind = {item.s + open, item.length - open, item.column + (int)open};
    if (find_outside(behind, ")") != behind.length - 1)
        return -1;
    const part within = part_of(item, open + 1, item.length - open - 2);
    for (int k = 0; k < count; k++) {
        bool same = strlen(words[k].word) == open && strncmp(words[k].word, item.s, open) == 0;
        if (!same || (words[k].arguments == 1 && find_outside(within, ",") < within.length))
            continue;
        *inside = within;
        return k;
    }
    return -1;
}

/* The channel of a text, which other quantities may share. */
static kempe_status find_channel(reading *r, part text, bool condition, int *channel)
{
    kmp_run_quantities *run = &r->list->run;
    if (text.length == 0)
        return complain(r, text, "an expression is missing");
    for (int k = 0; k < run->channels; k++)
        if (r->channel[k].condition == condition && strlen(r->channel[k].text) == text.length &&
            strncmp(r->channel[k].text, text.s, text.length) == 0) {
            *channel = k;
            return KEMPE_OK;
        }
    *channel = run->channels++;
    r->channel[*channel] = (kmp_added_value){.text = copy_of(r, text), .column = text.column, .condition = condition};
    return kmp_made(r->context, r->channel[*channel].text);
}

static kempe_status read_time(reading *r, part text, double *time)
{
    const char *s = copy_of(r, text);
    KMP_TRY(kmp_made(r->context, s));
    KMP_TRY(added_number(r->copy, r->label, s, text.column, "the time", KMP_DIM_TIME, time));
    if (*time < 0)
        return complain(r, text, "the time must not be negative");
    r->list->last_time = fmax(r->list->last_time, *time);
    return KEMPE_OK;
}

/* The place of a word between spaces outside parentheses; the length of the text: there is none. */
static size_t find_apart(part p, const char *word)
{
    size_t length = strlen(word);
    int depth = 0;
    for (size_t k = 0; k + length < p.length; k++) {
        depth += (p.s[k] == '(') - (p.s[k] == ')');
        if (depth == 0 && k > 0 && isspace((unsigned char)p.s[k - 1]) && strncmp(p.s + k, word, length) == 0 &&
            isspace((unsigned char)p.s[k + length]))
            return k;
    }
    return p.length;
}

/* Takes "from TIME", "to TIME" or "from TIME to TIME" from the end of an item. */
static kempe_status take_span(reading *r, part *item, kmp_run_quantity *q)
{
    enum { FROM = 4, TO = 2 };
    const part written = *item;
    const size_t from = find_apart(written, "from");
    const bool begins = from < written.length;
    const part behind = begins ? part_of(written, from + FROM, written.length - from - FROM) : written;
    const size_t to = find_apart(behind, "to");
    const bool ends = to < behind.length;
    if (!begins && !ends)
        return KEMPE_OK;
    *item = part_of(written, 0, begins ? from : to);
    part inside;
    int row = find_word(*item, &inside);
    if (row < 0 || words[row].kind == KMP_TAKE_AT)
        return complain(r, written,
                        "a span of time is for max(..), min(..), range(..), mean(..), rms(..), integral(..), "
                        "first(..), count(..) or duration(..)");
    q->spanned = true;
    q->end = INFINITY;
    if (begins)
        KMP_TRY(read_time(r, part_of(behind, 0, to), &q->begin));
    if (ends)
        KMP_TRY(read_time(r, part_of(behind, to + TO, behind.length - to - TO), &q->end));
    return q->end > q->begin ? KEMPE_OK : complain(r, written, "the span ends before it begins");
}

static int value_named(const reading *r, part name)
{
    for (int k = 0; k < r->list->run.values; k++)
        if (strlen(r->name[k]) == name.length && strncmp(r->name[k], name.s, name.length) == 0)
            return k;
    return -1;
}

static kempe_status add_quantity(reading *r, part item)
{
    kmp_run_quantities *run = &r->list->run;
    const part written = item, name = take_name(&item);
    kmp_run_quantity q = {.first_value = run->values};
    KMP_TRY(take_span(r, &item, &q));
    part inside = item;
    int row = find_word(item, &inside);
    q.kind = row < 0 ? KMP_TAKE_END : words[row].kind;
    if (value_named(r, name) >= 0)
        return complain(r, written, "a quantity of this name is there already");
    if (q.kind == KMP_TAKE_AT) {
        size_t comma = find_outside(inside, ",");
        if (comma == inside.length)
            return complain(r, written, "at(EXPRESSION, TIME) is expected");
        KMP_TRY(read_time(r, part_of(inside, comma + 1, inside.length - comma - 1), &q.time));
        inside = part_of(inside, 0, comma);
    }
    KMP_TRY(find_channel(r, inside, row >= 0 && words[row].condition, &q.channel));
    r->name[run->values++] = copy_of(r, name);
    if (kmp_run_quantity_width(q.kind) == 2) {
        r->name[run->values] = kmp_arena_printf(&r->list->arena, "%.*s.time", (int)name.length, name.s);
        run->values++;
    }
    r->of[run->count++] = q;
    return kmp_made(r->context, !r->list->arena.failed);
}

/* -- limits ------------------------------------------------------------------------------------------- */

static kempe_status add_limit(reading *r, part item)
{
    kmp_quantity_list *list = r->list;
    size_t sign = find_outside(item, "<>");
    if (sign == item.length)
        return complain(r, item, "QUANTITY < VALUE is expected, or one of <=, >, >=");
    bool or_equal = sign + 1 < item.length && item.s[sign + 1] == '=';
    size_t behind = sign + 1 + or_equal;
    part left = part_of(item, 0, sign), right = part_of(item, behind, item.length - behind);
    int value = value_named(r, left);
    if (value < 0) {
        value = list->run.values;
        KMP_TRY(add_quantity(r, left));
    }
    r->bound[list->limit_count] = right;
    kmp_quantity_limit *limit = &list->limit[list->limit_count++];
    *limit = (kmp_quantity_limit){
        .text = copy_of(r, item), .value = value, .sign = item.s[sign] == '<' ? 1 : -1, .or_equal = or_equal};
    for (int k = 0; k < list->run.count; k++)
        limit->whole = limit->whole || (r->of[k].kind == KMP_TAKE_COUNT && r->of[k].first_value == value);
    return kmp_made(r->context, limit->text != NULL);
}

/* The numbers of the limits, once the units of their quantities are known. */
static kempe_status read_bounds(reading *r)
{
    kmp_quantity_list *list = r->list;
    for (kmp_quantity_limit *limit = list->limit; limit < list->limit + list->limit_count; limit++) {
        const part written = r->bound[limit - list->limit];
        const char *bound = copy_of(r, written), *unit = r->unit[limit->value],
                   *what = kmp_arena_printf(&list->arena, "the limit of %s", r->name[limit->value]);
        kmp_dimension wanted = *unit ? kmp_dimension_of(unit) : KMP_DIM_ANY;
        wanted.angle = strcmp(unit, "rad") == 0;
        KMP_TRY(kmp_made(r->context, bound && what));
        KMP_TRY(added_number(r->copy, "limit", bound, written.column, what, wanted, &limit->bound));
    }
    return KEMPE_OK;
}

bool kmp_limit_holds(const kmp_quantity_limit *limit, double value)
{
    double over = limit->sign * (value - limit->bound);
    return limit->or_equal ? over <= 0 : over < 0;
}

double kmp_limit_size(const kmp_quantity_limit *limit)
{
    return limit->bound != 0 ? fabs(limit->bound) : 1;
}

double kmp_limit_excess(const kmp_quantity_limit *limit, double value)
{
    double bound = limit->sign * limit->bound;
    if (limit->whole && !limit->or_equal)
        bound = ceil(bound) - 1;
    return (limit->sign * value - bound) / kmp_limit_size(limit);
}

/* -- all ---------------------------------------------------------------------------------------------- */

static const char *unit_of(reading *r, const kmp_run_quantity *q, int number)
{
    const char *unit = r->channel[q->channel].unit;
    if (number > 0 || q->kind == KMP_TAKE_FIRST || q->kind == KMP_TAKE_DURATION)
        return "s";
    if (q->kind == KMP_TAKE_COUNT)
        return "";
    /* The integral of what has no known unit has none either. */
    return q->kind == KMP_TAKE_INTEGRAL && *unit ? kmp_arena_printf(&r->list->arena, "%s s", unit) : unit;
}

/* Arguments are the channels after the channels of the quantities. */
static bool add_arguments(reading *r, const kmp_added_arguments *arguments)
{
    kmp_run_quantities *run = &r->list->run;
    kmp_run_argument *argument = KMP_ARENA_NEW(&r->list->arena, kmp_run_argument, arguments->count);
    int *shown = KMP_ARENA_NEW(&r->list->arena, int, run->channels + arguments->count);
    if (!argument || !shown)
        return false;
    memcpy(shown, r->shown, (size_t)run->channels * sizeof *shown);
    for (int k = 0; k < arguments->count; k++) {
        const kmp_added_argument *a = &arguments->of[k];
        argument[k] = (kmp_run_argument){a->kind, a->of};
        shown[run->channels + k] = a->shown;
    }
    run->channels += arguments->count;
    run->arguments = arguments->count;
    run->turns = arguments->turns;
    run->argument = argument;
    run->shown = shown;
    r->list->argument_outputs = arguments->outputs;
    return true;
}

/* The joints of which loads of all joints are. */
static kempe_status list_loaded(reading *r, const kempe_model *model)
{
    for (int k = 0; k < 2; k++) {
        r->loaded[k] = KMP_ARENA_NEW(&r->list->arena, const char *, model->body_count + model->closure_count);
        KMP_TRY(kmp_made(r->context, r->loaded[k]));
        r->loaded_count[k] = kmp_reactions_name(model, k == 1, r->loaded[k]);
    }
    return KEMPE_OK;
}

static bool has_items(const char *text)
{
    part rest = whole_of(text), item;
    return next_item(&rest, &item);
}

static kempe_status read_all(kmp_quantity_list *list, const kempe_model *model, const char *quantities,
                             const char *limits)
{
    reading r = {.list = list, .context = model->context};
    KMP_TRY(list_loaded(&r, model));
    const int most_limits = count_items(&r, limits), most = count_items(&r, quantities) + most_limits;
    if (!has_items(quantities) && !has_items(limits))
        return KEMPE_OK;
    KMP_TRY(kmp_variant_new(model, 0, NULL, &list->variant));
    r.copy = kmp_variant_model(list->variant);
    KMP_TRY(kmp_made(model->context,
                     KMP_ARENA_MAKE(&list->arena, KMP_ROOM(kmp_run_quantity, most, &r.of),
                                    KMP_ROOM(kmp_added_value, most, &r.channel), KMP_ROOM(int, most, &r.shown),
                                    KMP_ROOM(const char *, 2 * most, &r.name, &r.unit),
                                    KMP_ROOM(part, most_limits, &r.bound),
                                    KMP_ROOM(kmp_quantity_limit, most_limits, &list->limit))));
    KMP_TRY(each_item(&r, quantities, "quantity", add_quantity));
    list->requested = list->run.count;
    KMP_TRY(each_item(&r, limits, "limit", add_limit));
    kmp_added_arguments arguments;
    KMP_TRY(add_values(r.copy, "quantity", list->run.channels, r.channel, &arguments));
    kmp_run_quantities *run = &r.list->run;
    for (int k = 0; k < run->count; k++) {
        kmp_run_quantity *q = &r.of[k];
        const bool averages = q->kind == KMP_TAKE_MEAN || q->kind == KMP_TAKE_RMS || q->kind == KMP_TAKE_INTEGRAL;
        q->or_equal = r.channel[q->channel].or_equal;
        q->averages = averages && r.channel[q->channel].late;
        run->inside = run->inside || kmp_run_quantity_inside(q->kind);
        for (int i = 0; i < kmp_run_quantity_width(q->kind); i++)
            r.unit[q->first_value + i] = unit_of(&r, q, i);
    }
    KMP_TRY(read_bounds(&r));
    for (int k = 0; k < run->channels; k++) {
        r.shown[k] = r.channel[k].shown;
        run->rates = run->rates || r.channel[k].rates;
        run->late = run->late || r.channel[k].late;
        run->loads = run->loads || r.channel[k].loads;
        run->computed = run->computed || r.shown[k] >= 0;
    }
    run->of = r.of;
    run->name = r.name;
    r.list->name = r.name;
    r.list->unit = r.unit;
    return kmp_made(model->context, add_arguments(&r, &arguments) && !list->arena.failed);
}

kempe_status kmp_quantity_list_init(kmp_quantity_list *list, const kempe_model *model, const char *quantities,
                                    const char *limits)
{
    *list = (kmp_quantity_list){0};
    list->words = kmp_arena_strdup(&list->arena, quantities ? quantities : "");
    list->limit_words = kmp_arena_strdup(&list->arena, limits ? limits : "");
    kempe_status status = kmp_made(model->context, !list->arena.failed);
    if (status == KEMPE_OK)
        status = read_all(list, model, quantities, limits);
    if (status != KEMPE_OK)
        kmp_quantity_list_free(list);
    return status == KEMPE_E_ARGUMENT ? KEMPE_E_INPUT : status; /* the texts are read as files are, with places */
}

KMP_CLEARS(kmp_quantity_list, list, kmp_variant_free(list->variant), kmp_arena_free(&list->arena))
