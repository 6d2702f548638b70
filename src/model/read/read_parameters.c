/* SPDX-License-Identifier: BSD-3-Clause */
/* Parameters: any may refer to any other. Each is valued as soon as its operands are; those left when nothing more can
 * be valued form a cycle. */
#include "model/read/reading.h"
#include <kempe/settings.h>
#include <math.h>
#include <string.h>

/* States of a parameter during valuation. */
typedef enum state { WAITING, KNOWN, BAD } state;

typedef struct valuation {
    kmp_reader *r;
    const kmp_yaml *map;
    const kmp_yaml **items; /* the parameters: their items of the map, or settings */
    const kmp_expr **exprs;
    state *states;
} valuation;

static bool is_reserved(const char *name)
{
    static const char *const words[] = {
#define KMP_FUNCTION(function, arity, value, node) #function,
#include "model/expressions/functions.def"
#undef KMP_FUNCTION
        "t", "pi", "q", "qd", NULL};
    for (int i = 0; words[i]; i++)
        if (strcmp(words[i], name) == 0)
            return true;
    return false;
}

/* A parameter that `expr` needs and that is in state `wanted`, or -1. */
static int find_need(const valuation *v, const kmp_expr *expr, state wanted)
{
    if (expr->kind == KMP_EXPR_PARAMETER)
        return v->states[expr->index] == wanted ? expr->index : -1;
    int need = expr->a ? find_need(v, expr->a, wanted) : -1;
    need = need < 0 && expr->b ? find_need(v, expr->b, wanted) : need;
    return need < 0 && expr->c ? find_need(v, expr->c, wanted) : need;
}

static state value_one(valuation *v, int i)
{
    kmp_reader *r = v->r;
    const kmp_yaml *node = v->items[i];
    if (find_need(v, v->exprs[i], BAD) >= 0)
        return BAD;
    if (find_need(v, v->exprs[i], WAITING) >= 0)
        return WAITING;
    double value = kmp_expr_value(v->exprs[i], r->parameter_values);
    if (!isfinite(value)) {
        kmp_reader_complain(r, node->place, "parameter '%s' is '%s', which is %s: a finite number is expected",
                            r->model->parameters[i].name, node->text, isnan(value) ? "not a number" : "infinite");
        return BAD;
    }
    r->parameter_values[i] = value;
    const char *what = kmp_reader_say(r, "parameter '%s'", r->model->parameters[i].name);
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

static int next_in_wait(const valuation *v, int i)
{
    return find_need(v, v->exprs[i], WAITING);
}

/* Follows dependences from `i`: after as many steps as there are parameters it is on the cycle. */
static void complain_circle(valuation *v, int i)
{
    kmp_reader *r = v->r;
    kmp_text chain = {0};
    for (int step = 0; step < v->map->count; step++)
        i = next_in_wait(v, i);
    int first = i;
    for (int k = next_in_wait(v, i); k != i; k = next_in_wait(v, k))
        first = k < first ? k : first;
    i = first;
    do {
        kmp_text_printf(&chain, "%s -> ", r->model->parameters[i].name);
        i = next_in_wait(v, i);
    } while (i != first);
    kmp_text_put(&chain, r->model->parameters[first].name);
    if (chain.failed)
        r->scratch.failed = true;
    kmp_reader_complain(r, v->map->keys[first]->place, "parameters depend on each other in a cycle: %s",
                        chain.failed ? "" : chain.s);
    kmp_text_free(&chain);
    v->states[first] = BAD; /* and with it the others, which depend on it */
}

/* The reader has the names, so that expressions find them, before any expression is read. */
static bool take_names(kmp_reader *r, const kmp_yaml *map)
{
    kempe_model *model = r->model;
    model->parameters = KMP_ARENA_NEW(&model->arena, kmp_parameter, map->count);
    r->parameter_known = KMP_ARENA_NEW(&r->scratch, bool, map->count);
    r->parameter_used = KMP_ARENA_NEW(&r->scratch, bool, map->count);
    r->parameter_shapes = KMP_ARENA_NEW(&r->scratch, bool, map->count);
    r->parameter_fixed = KMP_ARENA_NEW(&r->scratch, bool, map->count);
    r->parameter_values = KMP_ARENA_NEW(&r->scratch, double, map->count);
    r->parameter_dimensions = KMP_ARENA_NEW(&r->scratch, kmp_dimension, map->count);
    if (!model->parameters || !r->parameter_known || !r->parameter_used || !r->parameter_fixed ||
        !r->parameter_shapes || !r->parameter_values || !r->parameter_dimensions)
        return false;
    for (int i = 0; i < map->count; i++) {
        const char *name = kmp_read_name(r, map->keys[i], "a parameter");
        if (name && is_reserved(name))
            kmp_reader_complain(r, map->keys[i]->place,
                                "a parameter cannot have the name '%s', which is already defined", name);
        model->parameters[i].name = kmp_arena_strdup(&model->arena, map->keys[i]->text);
        if (!model->parameters[i].name)
            return false;
    }
    model->parameter_count = map->count;
    return true;
}

static void complain_setting(kmp_reader *r, kmp_place place, const char *name)
{
    kmp_nearest nearest = kmp_nearest_begin(name);
    for (int i = 0; i < r->model->parameter_count; i++)
        kmp_nearest_offer(&nearest, r->model->parameters[i].name);
    kmp_reader_complain_near(r, place, &nearest, "the model has no parameter '%s'", name);
}

/* A setting as a node of a file of its own; NULL: no memory. */
static kmp_yaml *node_of_setting(kmp_reader *r, const kempe_setting *setting)
{
    kmp_yaml *node = KMP_ARENA_NEW(&r->scratch, kmp_yaml, 1);
    const char *text = kmp_arena_strdup(&r->scratch, setting->value);
    int file = kmp_reader_add_file(r, kmp_reader_say(r, "--set %s", setting->name));
    if (!node || !text || file < 0)
        return NULL;
    node->place = node->text_place = (kmp_place){.line = 1, .column = 1, .file = file};
    node->text = text;
    node->empty = text[0] == '\0';
    return node;
}

static bool take_settings(kmp_reader *r, const kmp_yaml **items)
{
    for (int k = 0; k < r->setting_count; k++) {
        const kempe_setting *setting = &r->settings[k];
        const kmp_yaml *node = node_of_setting(r, setting);
        int i = 0;
        if (!node)
            return false;
        while (i < r->model->parameter_count && strcmp(r->model->parameters[i].name, setting->name) != 0)
            i++;
        if (i < r->model->parameter_count)
            items[i] = node;
        else
            complain_setting(r, node->place, setting->name);
    }
    return true;
}

static bool take_expressions(valuation *v)
{
    kmp_reader *r = v->r;
    v->exprs = KMP_ARENA_NEW(&r->scratch, const kmp_expr *, v->map->count);
    v->states = KMP_ARENA_NEW(&r->scratch, state, v->map->count);
    if (!v->exprs || !v->states)
        return false;
    for (int i = 0; i < v->map->count; i++) {
        const char *what = kmp_reader_say(r, "parameter '%s'", r->model->parameters[i].name);
        v->exprs[i] = kmp_read_constant(r, v->items[i], what);
        v->states[i] = v->exprs[i] ? WAITING : BAD;
    }
    return true;
}

void kmp_read_parameters(kmp_reader *r)
{
    valuation v = {.r = r, .map = kmp_yaml_get(r->root, "parameters")};
    int count = v.map && kmp_read_map(r, v.map, "parameters", NULL) ? v.map->count : 0;
    v.items = KMP_ARENA_NEW(&r->scratch, const kmp_yaml *, count);
    if (!v.items || (count > 0 && !take_names(r, v.map)))
        return;
    if (count > 0)
        memcpy(v.items, v.map->items, (size_t)count * sizeof *v.items);
    if (!take_settings(r, v.items) || count == 0 || !take_expressions(&v))
        return;
    value_all(&v);
    for (int i = 0; i < v.map->count; i++)
        if (v.states[i] == WAITING) {
            complain_circle(&v, i);
            value_all(&v);
        }
    for (int i = 0; i < v.map->count; i++) {
        r->parameter_known[i] = v.states[i] == KNOWN;
        if (v.states[i] == KNOWN)
            r->model->parameters[i].number = kmp_number_of(v.exprs[i], r->parameter_values[i]);
    }
}
