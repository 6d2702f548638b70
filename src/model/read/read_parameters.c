/* SPDX-License-Identifier: BSD-3-Clause */
/* Parameters and inputs. Any parameter may refer to any other. Each is valued behind its operands; those left
 * when nothing more can be valued form a cycle. */
#include "model/read/read_parameters.h"
#include "base/context.h"
#include "model/data/model.h"
#include "model/files/nodes.h"
#include "model/language/expression_value.h"
#include "model/read/read_include.h"
#include "model/read/read_tables.h"
#include "model/read/read_values.h"
#include "model/read/reading.h"
#include <ctype.h>
#include <kempe/settings.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* -- inputs ------------------------------------------------------------------------------------------ */

/* Inputs: their defaults and samples, and values given by settings: a number, or FILE:COLUMN:METHOD. */

static const kmp_key keys[] = {
#include "model/keys/input_keys.def"
    {0}};

/* -- samples --------------------------------------------------------------------------------------- */

/* Units in the head of a file: of the times, and of the values, which they give their dimension. */
static bool check_column_units(const kmp_points *p, kmp_model_input *input)
{
    const kmp_yaml *csv = kmp_yaml_get(p->map, "csv");
    if (!kmp_dimension_fits(p->unit[0].dimension, KMP_DIM_TIME))
        return kmp_complain_of(p->r, csv, p->what, "the unit of the column of times is not a unit of time");
    if (!kmp_dimension_fits(p->unit[1].dimension, input->dimension))
        return kmp_complain_of(p->r, csv, p->what, "the unit of the column of values does not fit 'unit: %s'",
                               input->unit);
    if (p->has_unit[1])
        input->dimension = p->unit[1].dimension;
    return true;
}

static void read_samples(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_model_input *input)
{
    kmp_points p = {.r = r,
                    .map = map,
                    .what = what,
                    .key = {"t", "value"},
                    .dimension = KMP_DIM_NUMBER,
                    .unit = {{.dimension = KMP_DIM_ANY}, {.dimension = KMP_DIM_ANY}}};
    const kmp_yaml *method = kmp_yaml_get(map, "method");
    if (!method) {
        kmp_text words = {0};
        kmp_name_list_print(&words, kmp_signal_words, ", ", " or ");
        kmp_reader_complain(r, map->place, "%s has no key 'method': its samples need %s", what, words.s ? words.s : "");
        r->scratch.failed = r->scratch.failed || words.failed;
        kmp_text_free(&words);
    }
    int word = method ? kmp_read_choice(r, method, what, kmp_signal_words, "the method is") : -1;
    if (word < 0 || !kmp_read_points(&p) || (p.count > 1 && !kmp_points_increase(&p, "times", "sample")))
        return;
    if (p.count < 1) {
        kmp_reader_complain(r, map->place, "%s has no samples", what);
        return;
    }
    if (!check_column_units(&p, input))
        return;
    for (int k = 0; k < p.count && !p.has_unit[1]; k++)
        p.y[k] *= input->si;
    (void)kmp_signal_init(&input->signal, &r->model->arena, (kmp_signal_method)word, p.count, p.x, p.y);
}

/* Columns without a name are the column of the time, and the column of the input's own name. */
static const kmp_yaml *with_columns(kmp_reader *r, const kmp_yaml *map, const char *name)
{
    kmp_yaml *full = kmp_yaml_copy(&r->scratch, map);
    kmp_yaml_put_word(&r->scratch, full, map->place, "t", kmp_yaml_get(map, "t") ? NULL : "t");
    kmp_yaml_put_word(&r->scratch, full, map->place, "value", kmp_yaml_get(map, "value") ? NULL : name);
    return full ? full : map;
}

/* -- settings -------------------------------------------------------------------------------------- */

const char *kmp_setting_of(const kmp_reader *r, const char *name)
{
    for (int k = r->setting_count; k-- > 0;)
        if (strcmp(r->settings[k].name, name) == 0)
            return r->settings[k].value;
    return NULL;
}

/* FILE:COLUMN:METHOD as the mapping that the model's file would have. */
static const kmp_yaml *samples_of(kmp_reader *r, kmp_place place, const char *text)
{
    static const char *const parts[] = {"csv", "value", "method"};
    const char *method = strrchr(text, ':'), *column = method;
    while (column > text && *--column != ':')
        ;
    const char *begin[] = {text, column + 1, method + 1}, *end[] = {column, method, method + strlen(method)};
    kmp_yaml *map = kmp_yaml_new(&r->scratch, KMP_YAML_MAP, place);
    if (column == text) {
        kmp_reader_complain(r, place, "a number or FILE:COLUMN:METHOD is expected here, not '%s'", text);
        return NULL;
    }
    for (int k = 0; k < 3; k++)
        kmp_yaml_put_word(&r->scratch, map, place, parts[k],
                          kmp_reader_say(r, "%.*s", (int)(end[k] - begin[k]), begin[k]));
    kmp_yaml_put_word(&r->scratch, map, place, "t", "t");
    return map;
}

/* A given value, in place of the default and of the samples of the file. */
static void read_setting(kmp_reader *r, const char *text, const char *what, kmp_model_input *input)
{
    int file = kmp_reader_add_file(r, kmp_reader_say(r, "--input %s", input->name));
    kmp_place place = {.line = 1, .column = 1, .file = file};
    const kmp_yaml *node = file < 0 ? NULL : kmp_yaml_word(&r->scratch, place, text);
    if (node && !strchr(text, ':')) {
        (void)kmp_read_quantity(r, node, what, input->dimension, input->si, &input->value);
        return;
    }
    const kmp_yaml *map = node ? samples_of(r, place, text) : NULL;
    if (map)
        read_samples(r, map, what, input);
}

/* -- the section ----------------------------------------------------------------------------------- */

static void read_input(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_model_input *input)
{
    const char *given = kmp_setting_of(r, input->name);
    if (!kmp_read_map(r, map, what, keys))
        return;
    const kmp_yaml *value = kmp_yaml_get(map, "default"), *csv = kmp_yaml_get(map, "csv");
    bool sampled = csv || kmp_yaml_get(map, "t") || kmp_yaml_get(map, "value") || kmp_yaml_get(map, "method");
    const kmp_yaml *node = kmp_yaml_get(map, "unit");
    kmp_unit unit;
    const char *text = node ? kmp_read_word(r, node, kmp_reader_say(r, "unit of %s", what)) : NULL;
    if (text && kmp_unit_read(text, strlen(text), &unit)) {
        input->unit = kmp_arena_strdup(&r->model->arena, text);
        input->dimension = unit.dimension;
        input->si = unit.factor / unit.divisor;
    } else if (text) {
        kmp_reader_complain(r, node->place, "unit of %s: '%s' is not a unit", what, text);
    }
    const kmp_yaml *single = csv || kmp_yaml_get(map, "t") ? NULL : kmp_yaml_get(map, "value");
    if (single && single->kind == KMP_YAML_SCALAR) {
        kmp_reader_complain(r, single->place, "%s has a value without times: a constant value is 'default: %s'", what,
                            single->text);
        sampled = false;
    }
    if (value)
        (void)kmp_read_quantity(r, value, kmp_reader_say(r, "default of %s", what), input->dimension, input->si,
                                &input->value);
    if (given)
        read_setting(r, given, what, input);
    else if (sampled)
        read_samples(r, csv ? with_columns(r, map, input->name) : map, what, input);
    static const double start = 0;
    if (input->signal.count == 0)
        (void)kmp_signal_init(&input->signal, &r->model->arena, KMP_SIGNAL_HOLD, 1, &start, &input->value);
}

void kmp_read_inputs(kmp_reader *r)
{
    kempe_model *model = r->model;
    kmp_section s = kmp_read_section(r, "inputs", "input");
    model->inputs = KMP_ARENA_NEW(&model->arena, kmp_model_input, s.count);
    while (model->inputs && kmp_section_next(&s)) {
        if (kmp_name_means_something(r, s.name))
            kmp_reader_complain(r, s.key->place, "an input cannot have the name '%s', which is already defined",
                                s.name);
        kmp_model_input *input = &model->inputs[model->input_count++];
        *input = (kmp_model_input){.name = s.name, .place = s.key->place, .unit = "", .si = 1};
        read_input(r, s.node, s.what, input);
    }
}

void kmp_settle_inputs(const kmp_reader *r)
{
    const kempe_model *model = r->model;
    for (int k = 0; !r->wrong && k < model->input_count; k++)
        if (!model->inputs[k].used && !kmp_reader_instance(r, model->inputs[k].place.file))
            kmp_log(r->context, KEMPE_LOG_WARNING, "%s:%d:%d: input '%s' is not used",
                    model->source.files[model->inputs[k].place.file], model->inputs[k].place.line,
                    model->inputs[k].place.column, model->inputs[k].name);
}

/* -- parameters -------------------------------------------------------------------------------------- */

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

/* A parameter that parameter i waits for. */
static int next_in_wait(const void *user, int i)
{
    const valuation *v = user;
    return kmp_expr_find(v->exprs[i], is_waiting, v)->index;
}

/* Values parameter i, and before it the parameters that it waits for; room (count). False: they form a cycle. */
static bool value_from(valuation *v, int i, int *room)
{
    int depth = 0;
    for (room[depth++] = i; depth > 0;) {
        const int top = room[depth - 1];
        v->states[top] = v->states[top] == WAITING ? value_one(v, top) : v->states[top];
        if (v->states[top] != WAITING)
            depth--;
        else if (depth < v->map->count)
            room[depth++] = next_in_wait(v, top);
        else
            return false;
    }
    return true;
}

/* Values all parameters except a cycle and its users. False: no memory. */
static bool value_all(valuation *v)
{
    int *room = KMP_ARENA_NEW(&v->r->scratch, int, v->map->count);
    bool progress = true, circle = false;
    for (int i = 0; room && !circle && i < v->map->count; i++)
        circle = !value_from(v, i, room);
    while (circle && progress) {
        progress = false;
        for (int i = 0; i < v->map->count; i++) {
            if (v->states[i] != WAITING)
                continue;
            v->states[i] = value_one(v, i);
            progress = progress || v->states[i] != WAITING;
        }
    }
    return room;
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
        if (kmp_name_find(KMP_NAMES_OF(reserved), s->name) >= 0 && !kmp_function_yields(s->name))
            kmp_reader_complain(r, s->key->place, "a parameter cannot have the name '%s', which is already defined",
                                s->name);
        model->parameters[model->parameter_count++].name = s->name;
    }
    return model->parameter_count == s->count;
}

/* A setting is a node of a separate file. */
static bool take_settings(kmp_reader *r, const kmp_yaml **items)
{
    kmp_name_list names = KMP_NAMED(r->model, parameter);
    for (int k = 0; k < r->setting_count; k++) {
        const kempe_setting *setting = &r->settings[k];
        if (kmp_yaml_get(kmp_yaml_get(r->root, "inputs"), setting->name))
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

/* Warns of a setting without a unit whose number is near to the number of the file, which has a unit that is not near
 * to SI, or is more than a turn where the file has degrees. */
static void warn_of_unit(valuation *v, int i)
{
    const kmp_yaml *file = v->map->items[i], *set = v->items[i];
    char *unit, *end;
    if (set == file || file->kind != KMP_YAML_SCALAR || set->kind != KMP_YAML_SCALAR || v->states[i] != KNOWN)
        return;
    const double number = strtod(file->text, &unit), given = strtod(set->text, &end);
    while (*unit == ' ')
        unit++;
    const bool turns = strcmp(unit, "deg") == 0 && fabs(given) > KMP_MORE_TURN;
    if (*end || !isalpha((unsigned char)*unit) ||
        (!turns && !(fabs(given) > fabs(number) / NEAR && fabs(given) < fabs(number) * NEAR)))
        return;
    const kmp_expr *e = kmp_read_constant(v->r, file, v->map->keys[i]->text);
    const double factor = e && e->kind == KMP_EXPR_NUMBER && number != 0 ? e->value / number : 1;
    if (factor < 1 / UNIT_APART || factor > UNIT_APART)
        kmp_log(v->r->model->context, KEMPE_LOG_WARNING,
                "parameter '%s' is set to %s, a number in SI, and the file has '%s': write '%s %s' for its unit",
                v->r->model->parameters[i].name, set->text, file->text, set->text, unit);
}

/* A setting has the dimension of the number with a unit that the file has. */
static void check_setting(valuation *v, int i)
{
    kmp_reader *r = v->r;
    const kmp_yaml *file = v->map->items[i], *set = v->items[i];
    if (set == file || file->kind != KMP_YAML_SCALAR || v->states[i] != KNOWN)
        return;
    const char *name = r->model->parameters[i].name;
    const kmp_expr *e = kmp_read_constant(r, file, name);
    const char *what = kmp_reader_say(r, "parameter '%s', which is '%s' in the file", name, file->text);
    kmp_dimension found;
    if (e && e->kind == KMP_EXPR_NUMBER && e->unit.kind == KMP_DIMENSION_KNOWN &&
        !kmp_check_dimension(r, set, what, v->exprs[i], e->unit, &found))
        v->states[i] = BAD;
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
    if (!value_all(&v))
        return;
    for (int i = 0; i < v.map->count; i++)
        if (v.states[i] == WAITING) {
            int at = i; /* after as many steps as there are parameters it is on the cycle */
            for (int step = 0; step < v.map->count; step++)
                at = next_in_wait(&v, at);
            const char *chain = kmp_reader_cycle(r, KMP_NAMED(r->model, parameter), next_in_wait, &v, at, &at);
            kmp_reader_complain(r, v.map->keys[at]->place, "parameters depend on each other in a cycle: %s", chain);
            v.states[at] = BAD; /* and with it the others, which depend on it */
            if (!value_all(&v))
                return;
        }
    for (int i = 0; i < v.map->count; i++) {
        check_setting(&v, i);
        warn_of_unit(&v, i);
        r->parameter_known[i] = v.states[i] == KNOWN;
        if (v.states[i] != KNOWN)
            continue;
        r->model->parameters[i].number = kmp_number_of(v.exprs[i], r->parameter_values[i]);
        r->model->parameters[i].dimension = r->parameter_dimensions[i];
        kmp_text unit = {0};
        kmp_dimension_put_unit(&unit, r->parameter_dimensions[i]);
        r->model->parameters[i].unit = kmp_text_keep(&unit, &r->model->arena);
        r->model->parameters[i].extent = v.extents[i];
    }
}

/* -- parameters without influence -------------------------------------------------------------------- */

/* Most are misspelt, or left over. The user is warned of parameters of the file itself, and of any that is set in vain:
 * by
 * --set, or by the file that includes theirs. */

static void warn(const kmp_reader *r, kmp_place place, const char *name, const char *vain)
{
    char where[48] = "";
    if (place.line > 0) /* a call has none */
        (void)snprintf(where, sizeof where, ":%d:%d", place.line, place.column);
    kmp_log(r->context, KEMPE_LOG_WARNING, "%s%s: parameter '%s' is not used%s", r->model->source.files[place.file],
            where, name, vain);
}

/* For parameters of included files, warns only of the ones that the including file has set. */
static void warn_of_file(const kmp_reader *r, const kmp_yaml *map, int i)
{
    kmp_parameter *parameter = &r->model->parameters[i];
    kmp_place own = map->keys[i]->place, item = map->items[i]->place;
    parameter->unused = item.file != own.file || !kmp_reader_instance(r, own.file);
    if (item.file != own.file)
        warn(r, item, parameter->name, ": setting it where its file is included has no effect");
    else if (parameter->unused)
        warn(r, own, parameter->name, "");
}

void kmp_settle_parameters(kmp_reader *r)
{
    if (!r->wrong && !r->scratch.failed && r->model->parameter_count > 0) {
        const kmp_yaml *map = kmp_yaml_get(r->root, "parameters");
        kempe_model *model = r->model;
        for (int i = 0; i < model->parameter_count; i++) {
            const char *set = kmp_setting_of(r, model->parameters[i].name);
            model->parameters[i].unused = set && !model->parameters[i].used;
            if (model->parameters[i].unused)
                warn(r, map->keys[i]->place, model->parameters[i].name, ": setting it has no effect");
        }
        /* Displaced values use parameters of the file, too: those are not unused. */
        for (int i = 0; i < map->count; i++)
            if (model->parameters[i].used && kmp_setting_of(r, model->parameters[i].name))
                kmp_reader_use(r, kmp_read_constant(r, map->items[i], model->parameters[i].name));
        for (int i = 0; i < model->parameter_count; i++)
            if (!model->parameters[i].used && !kmp_setting_of(r, model->parameters[i].name))
                warn_of_file(r, map, i);
    }
}
