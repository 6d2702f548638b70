/* SPDX-License-Identifier: BSD-3-Clause */
/* Parameters: any may refer to any other. Each is valued as soon as its operands are; those left when nothing more can
 * be valued form a cycle. */
#include "model/read/read_parameters.h"
#include "model/data/model.h"
#include "model/files/nodes.h"
#include "model/language/expression_value.h"
#include "model/read/files.h"
#include "model/read/read_inputs.h"
#include "model/read/read_values.h"
#include "model/read/reading.h"
#include <ctype.h>
#include <kempe/settings.h>
#include <math.h>
#include <stdlib.h>

/* States of a parameter during valuation. */
typedef enum state { WAITING, KNOWN, BAD } state;

typedef struct valuation {
    kmp_reader *r;
    const kmp_yaml *map;
    const kmp_yaml **items; /* the parameters: their items of the map, or settings */
    const kmp_expr **exprs;
    state *states;
    kmp_extent *extents;
} valuation;

/* Numbers within this factor are near; units within the other are. rad and degrees differ by 57, m and mm by 1000. */
#define NEAR       4.0
#define UNIT_APART 20.0

static const char *const reserved[] = {
#define KMP_FUNCTION(function, arity, value, node) #function,
#include "model/language/functions.def"
#undef KMP_FUNCTION
    "t", "pi", "q", "qd"};

static bool is_bad(const kmp_expr *expr, const void *user)
{
    const valuation *v = user;
    return expr->kind == KMP_EXPR_PARAMETER && v->states[expr->index] == BAD;
}

static bool is_waiting(const kmp_expr *expr, const void *user)
{
    const valuation *v = user;
    return expr->kind == KMP_EXPR_PARAMETER && v->states[expr->index] == WAITING;
}

static state value_one(valuation *v, int i)
{
    kmp_reader *r = v->r;
    const kmp_yaml *node = v->items[i];
    if (kmp_expr_find(v->exprs[i], is_bad, v))
        return BAD;
    if (kmp_expr_find(v->exprs[i], is_waiting, v))
        return WAITING;
    double value = kmp_expr_value(v->exprs[i], r->parameter_values);
    const char *what = kmp_reader_say(r, "parameter '%s'", r->model->parameters[i].name);
    if (!kmp_check_finite(r, node, what, value))
        return BAD;
    r->parameter_values[i] = value;
    v->extents[i] = kmp_expr_extent(v->exprs[i], v->extents);
    return kmp_check_dimension(r, node, what, v->exprs[i], KMP_DIM_ANY, &r->parameter_dimensions[i]) ? KNOWN : BAD;
}

static void value_all(valuation *v)
{
    bool progress = true;
    while (progress) {
        progress = false;
        for (int i = 0; i < v->map->count; i++) {
            if (v->states[i] != WAITING)
                continue;
            v->states[i] = value_one(v, i);
            progress = progress || v->states[i] != WAITING;
        }
    }
}

/* A parameter that parameter i waits for. */
static int next_in_wait(const void *user, int i)
{
    const valuation *v = user;
    return kmp_expr_find(v->exprs[i], is_waiting, v)->index;
}

/* Follows dependences from `i`: after as many steps as there are parameters it is on the cycle. */
static void complain_circle(valuation *v, int i)
{
    for (int step = 0; step < v->map->count; step++)
        i = next_in_wait(v, i);
    const char *chain = kmp_reader_cycle(v->r, KMP_NAMED(v->r->model, parameter), next_in_wait, v, i, &i);
    kmp_reader_complain(v->r, v->map->keys[i]->place, "parameters depend on each other in a cycle: %s", chain);
    v->states[i] = BAD; /* and with it the others, which depend on it */
}

/* The reader has the names, so that expressions find them, before any expression is read. */
static bool take_names(kmp_section *s)
{
    kmp_reader *r = s->r;
    kempe_model *model = r->model;
    model->parameters = KMP_ARENA_NEW(&model->arena, kmp_parameter, s->count);
    KMP_ARENA_MAKE(&r->scratch, KMP_ROOM(bool, s->count, &r->parameter_known),
                   KMP_ROOM(double, s->count, &r->parameter_values),
                   KMP_ROOM(kmp_dimension, s->count, &r->parameter_dimensions));
    if (r->scratch.failed || model->arena.failed)
        return false;
    while (kmp_section_next(s)) {
        if (kmp_name_find(KMP_NAMES_OF(reserved), s->name) >= 0)
            kmp_reader_complain(r, s->key->place, "a parameter cannot have the name '%s', which is already defined",
                                s->name);
        model->parameters[model->parameter_count++].name = s->name;
    }
    return model->parameter_count == s->count;
}

/* A setting is a node of a file of its own. */
static bool take_settings(kmp_reader *r, const kmp_yaml **items)
{
    kmp_name_list names = KMP_NAMED(r->model, parameter);
    for (int k = 0; k < r->setting_count; k++) {
        const kempe_setting *setting = &r->settings[k];
        if (kmp_is_input_setting(r, setting->name))
            continue;
        int file = kmp_reader_add_file(r, kmp_reader_say(r, "--set %s", setting->name));
        kmp_place place = {.line = 1, .column = 1, .file = file};
        const kmp_yaml *node = file < 0 ? NULL : kmp_yaml_word(&r->scratch, place, setting->value);
        if (!node)
            return false;
        int i = kmp_name_find(names, setting->name);
        kmp_nearest nearest = kmp_nearest_of(setting->name, names);
        if (i >= 0)
            items[i] = node;
        else
            kmp_reader_complain_near(r, place, &nearest, "the model has no parameter '%s'", setting->name);
    }
    return true;
}

static bool take_expressions(valuation *v)
{
    kmp_reader *r = v->r;
    v->exprs = KMP_ARENA_NEW(&r->scratch, const kmp_expr *, v->map->count);
    v->states = KMP_ARENA_NEW(&r->scratch, state, v->map->count);
    v->extents = KMP_ARENA_NEW(&r->scratch, kmp_extent, v->map->count);
    if (!v->exprs || !v->states || !v->extents)
        return false;
    for (int i = 0; i < v->map->count; i++) {
        const char *what = kmp_reader_say(r, "parameter '%s'", r->model->parameters[i].name);
        v->exprs[i] = kmp_read_constant(r, v->items[i], what);
        v->states[i] = v->exprs[i] ? WAITING : BAD;
    }
    return true;
}

/* Warns of a setting without a unit whose number is near to that of the file, which has a unit that is not near to SI.
 */
static void warn_of_unit(valuation *v, int i)
{
    const kmp_yaml *file = v->map->items[i], *set = v->items[i];
    char *unit, *end;
    if (set == file || file->kind != KMP_YAML_SCALAR || set->kind != KMP_YAML_SCALAR || v->states[i] != KNOWN)
        return;
    const double number = strtod(file->text, &unit), given = strtod(set->text, &end);
    while (*unit == ' ')
        unit++;
    if (*end || !isalpha((unsigned char)*unit) || !(fabs(given) > fabs(number) / NEAR) ||
        !(fabs(given) < fabs(number) * NEAR))
        return;
    const kmp_expr *e = kmp_read_constant(v->r, file, v->map->keys[i]->text);
    const double factor = e && e->kind == KMP_EXPR_NUMBER && number != 0 ? e->value / number : 1;
    if (factor < 1 / UNIT_APART || factor > UNIT_APART)
        kmp_log(v->r->model->context, KEMPE_LOG_WARNING,
                "parameter '%s' is set to %s, a number in SI, and the file has '%s': write '%s %s' for its unit",
                v->r->model->parameters[i].name, set->text, file->text, set->text, unit);
}

void kmp_read_parameters(kmp_reader *r)
{
    kmp_section section = kmp_read_section(r, "parameters", "parameter");
    valuation v = {.r = r, .map = section.map};
    int count = section.count;
    v.items = KMP_ARENA_NEW(&r->scratch, const kmp_yaml *, count);
    if (!v.items || !take_names(&section))
        return;
    for (int i = 0; i < count; i++)
        v.items[i] = v.map->items[i];
    if (!take_settings(r, v.items) || count == 0 || !take_expressions(&v))
        return;
    value_all(&v);
    for (int i = 0; i < v.map->count; i++)
        if (v.states[i] == WAITING) {
            complain_circle(&v, i);
            value_all(&v);
        }
    for (int i = 0; i < v.map->count; i++) {
        warn_of_unit(&v, i);
        r->parameter_known[i] = v.states[i] == KNOWN;
        if (v.states[i] != KNOWN)
            continue;
        r->model->parameters[i].number = kmp_number_of(v.exprs[i], r->parameter_values[i]);
        r->model->parameters[i].dimension = r->parameter_dimensions[i];
        r->model->parameters[i].extent = v.extents[i];
    }
}
