/* SPDX-License-Identifier: BSD-3-Clause */
/* Expressions become sensors of the copy, read by the functions of the file's reader. Parameters have no known
 * dimensions after reading: an expression with one fits any dimension. */
#include "ensemble/added_values.h"
#include "ensemble/expression_arguments.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include "model/language/expression_dimension.h"
#include "model/language/expression_references.h"
#include "model/language/expression_value.h"
#include "model/read/read_outputs.h"
#include "model/read/read_values.h"
#include "model/read/reading.h"
#include <string.h>

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
    *a = (adding){.label = {label}, .files = copy->files, .file_count = copy->file_count};
    a->r = (kmp_reader){.context = copy->context, .model = copy, .file = label, .locals = &a->locals};
    copy->files = a->label;
    copy->file_count = 1;
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
    copy->files = a->files;
    copy->file_count = a->file_count;
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
    static const kmp_output_kind kinds[] = {
        KMP_OUTPUT_FORCE,    KMP_OUTPUT_GAP,  KMP_OUTPUT_ENERGY,           KMP_OUTPUT_MOMENTUM, KMP_OUTPUT_CONTACT,
        KMP_OUTPUT_GUIDANCE, KMP_OUTPUT_POSE, KMP_OUTPUT_ANGULAR_MOMENTUM, KMP_OUTPUT_CUT_QDD};
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
              output->kind != KMP_OUTPUT_ANGULAR_MOMENTUM && output->kind != KMP_OUTPUT_GAP;
    return KEMPE_OK;
}

/* -- expressions ------------------------------------------------------------------------------------- */

/* The unit of an expression: of a coordinate or a measure its own, otherwise by its dimension. */
static const char *unit_of(kempe_model *copy, adding *a, const kmp_expr *e)
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
    if (e->kind == KMP_EXPR_MEASURE)
        return units[e->measure->kind];
    kmp_text text = {0};
    kmp_expr_fault fault = {0};
    kmp_dimension d = kmp_expr_dimension(e, a->r.parameter_dimensions, a->r.parameter_values, &fault);
    if (!kmp_dimension_is_physical(d))
        return "";
    kmp_dimension_print(&text, d);
    return kmp_text_keep(&text, &copy->arena);
}

static const kmp_expr *difference_of(kempe_model *copy, const kmp_expr *e, bool *or_equal)
{
    bool less = e->kind == KMP_EXPR_LESS || e->kind == KMP_EXPR_AT_MOST;
    kmp_expr *made = KMP_ARENA_NEW(&copy->arena, kmp_expr, 1);
    *or_equal = e->kind == KMP_EXPR_AT_MOST || e->kind == KMP_EXPR_AT_LEAST;
    if (made)
        *made = (kmp_expr){.kind = KMP_EXPR_SUB, .a = less ? e->a : e->b, .b = less ? e->b : e->a, .column = e->column};
    return made;
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
        v->unit = v->condition ? "" : unit_of(copy, &a, e);
        v->late = kmp_expr_acceleration(e) || kmp_expr_lambda(e);
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
    bool listed = kmp_expr_arguments(&m->copy->arena, m->read[k].expr, &m->list[k]);
    for (const kmp_expr_argument *a = m->list[k]; a; a = a->next)
        m->known++;
    return kmp_made(m->copy->context, listed);
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

kempe_status kmp_add_values(kempe_model *copy, const char *label, int count, kmp_added_value *values,
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

kempe_status kmp_added_number(kempe_model *copy, const char *label, const char *text, int column, const char *what,
                              kmp_dimension dimension, double *number)
{
    adding a;
    KMP_TRY(begin(&a, copy, label));
    const kmp_yaml node = node_of(text, column);
    (void)kmp_read_fixed(&a.r, &node, what, dimension, number);
    return end(&a);
}
