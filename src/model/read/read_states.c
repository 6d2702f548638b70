/* SPDX-License-Identifier: BSD-3-Clause */
/* States and function blocks: their names and motions before any expression is read that may contain them; the laws of
 * states after all that those may contain, the value of a block that is an expression where it is first used. */
#include "model/read/read_states.h"
#include "model/data/model.h"
#include "model/language/expression_functions.h"
#include "model/language/expression_references.h"
#include "model/language/expression_value.h"
#include "model/read/function_block.h"
#include "model/read/read_algebraic.h"
#include "model/read/read_compliant.h"
#include "model/read/read_controllers.h"
#include "model/read/read_delays.h"
#include "model/read/read_filters.h"
#include "model/read/read_tables.h"
#include "model/read/read_values.h"
#include <math.h>
#include <string.h>

static const kmp_key keys[] = {
#include "model/keys/state_keys.def"
    {0}};

enum { MOST_NESTED_BLOCKS = 50 }; /* reading them recurses */

/* -- formulas of blocks ------------------------------------------------------------------------------ */

static const kmp_expr *make(kmp_reader *r, kmp_expr expr)
{
    kmp_expr *e = KMP_ARENA_NEW(&r->model->arena, kmp_expr, 1);
    if (e)
        *e = expr;
    return e;
}

static const kmp_expr *zero(kmp_reader *r)
{
    return make(r, (kmp_expr){.kind = KMP_EXPR_NUMBER});
}

const kmp_expr *kmp_block_state(kmp_reader *r, const kmp_function_block *b, int i)
{
    return make(r, (kmp_expr){.kind = KMP_EXPR_QD, .index = kmp_model_coordinates(r->model) + b->first + i});
}

void kmp_block_local(kmp_expr_locals *locals, const char *name, const kmp_expr *expr)
{
    if (expr)
        locals->local[locals->count++] = (kmp_expr_local){name, expr, false};
}

const kmp_expr *kmp_block_formula(kmp_reader *r, const char *text, const kmp_expr_locals *locals)
{
    const char *kept = kmp_arena_strdup(&r->scratch, text);
    return kept && !r->scratch.failed && !r->model->arena.failed ? kmp_expr_formula(&r->model->arena, kept, locals)
                                                                 : NULL;
}

const kmp_expr *kmp_block_number(kmp_reader *r, const kmp_number *x)
{
    return x->expr ? x->expr : make(r, (kmp_expr){.kind = KMP_EXPR_NUMBER, .value = x->value});
}

const kmp_expr *kmp_block_key(kmp_reader *r, const kmp_function_block *b, const char *key, double *value)
{
    kmp_number number;
    const kmp_yaml *node = kmp_yaml_get(b->map, key);
    if (!node ||
        !kmp_read_number(r, node, kmp_reader_say(r, "%s of %s", key, b->what), kmp_key_dimension(keys, key), &number))
        return NULL;
    if (value)
        *value = number.value;
    return kmp_block_number(r, &number);
}

bool kmp_block_two(kmp_reader *r, const kmp_function_block *b, const char *key, kmp_number two[2])
{
    const kmp_yaml *list = kmp_yaml_get(b->map, key);
    const char *of = kmp_reader_say(r, "%s of %s", key, b->what);
    if (!list || !kmp_read_list(r, list, of, 2))
        return false;
    bool good = kmp_read_number(r, list->items[0], of, KMP_DIM_ANY, &two[0]);
    return kmp_read_number(r, list->items[1], of, KMP_DIM_ANY, &two[1]) && good;
}

const kmp_expr *kmp_block_input(kmp_reader *r, const kmp_function_block *b)
{
    const char *key = b->kind->key, *of = kmp_reader_say(r, "%s of %s", key, b->what);
    bool at_once = b->direct || b->sampled || b->kind == &kmp_block_delay;
    const kmp_yaml *node = kmp_yaml_get(b->map, key);
    const kmp_expr *u = kmp_read_expr(r, node, of, KMP_DIM_ANY, at_once ? KMP_OF_STATE : KMP_OF_LOADS);
    if (at_once && kmp_expr_lambda(u))
        kmp_reader_complain(r, node->place, "%s depends on multipliers, which is not allowed here", of);
    return u;
}

const kmp_expr *kmp_block_period(kmp_reader *r, const kmp_function_block *b)
{
    return make(r, (kmp_expr){.kind = KMP_EXPR_NUMBER, .value = r->model->states[b->first].period});
}

void kmp_block_law(kmp_reader *r, kmp_function_block *b, int i, const kmp_expr *law)
{
    if (b->sampled)
        r->model->states[b->first + i].next = law;
    b->rate[i] = b->sampled ? zero(r) : law;
}

void kmp_block_value(kmp_reader *r, const kmp_function_block *b, const kmp_expr *value)
{
    kmp_reader_take_named(r, b->map->place, b->what, value, &r->model->unknowns[b->output]);
}

/* -- states with a law of their own ------------------------------------------------------------------ */

static int one_state(kmp_reader *r, kmp_function_block *b)
{
    (void)r, (void)b;
    return 1;
}

static void read_rate(kmp_reader *r, kmp_function_block *b)
{
    b->rate[0] = kmp_read_expr(r, kmp_yaml_get(b->map, "rate"), kmp_reader_say(r, "rate of %s", b->what), KMP_DIM_ANY,
                               KMP_OF_LOADS);
}

/* The rate of a state that changes where a comparison becomes true: zero in any case, so that the comparison is a
 * condition of the equations, and its changes are located. */
static const kmp_expr *rate_with(kmp_reader *r, const kmp_expr *when)
{
    return make(r,
                (kmp_expr){.kind = KMP_EXPR_CALL, .function = KMP_FUNCTION_if, .a = when, .b = zero(r), .c = zero(r)});
}

static void read_next(kmp_reader *r, kmp_function_block *b)
{
    static const char *const times[] = {"sample", "when"};
    const kmp_yaml *node = kmp_yaml_get(b->map, "when");
    (void)kmp_read_one_key(r, b->map, b->what, KMP_NAMES_OF(times));
    b->rate[0] = zero(r);
    r->model->states[b->first].next = kmp_read_expr(
        r, kmp_yaml_get(b->map, "next"), kmp_reader_say(r, "next of %s", b->what), KMP_DIM_ANY, KMP_OF_STATE);
    if (!node)
        return;
    const kmp_expr *when =
        kmp_read_expr(r, node, kmp_reader_say(r, "when of %s", b->what), KMP_DIM_ANY, KMP_COMPARISON);
    if (kmp_expr_lambda(when))
        kmp_reader_complain(r, node->place, "when of %s: changes of multipliers are not located", b->what);
    if (kmp_expr_acceleration(when))
        kmp_reader_complain(r, node->place, "when of %s: changes of accelerations are not located", b->what);
    b->rate[0] = when ? rate_with(r, when) : NULL;
}

/* Hysteresis changes where its input leaves the interval of its limits; which limit it is, decides its value. */
static void read_hysteresis(kmp_reader *r, kmp_function_block *b)
{
    kmp_number limit[2], value[2] = {{.value = 0}, {.value = 1}};
    kmp_expr_locals locals = {0};
    kmp_block_local(&locals, "x", kmp_block_input(r, b));
    bool good = kmp_read_required(r, b->map, b->what, "limits") && kmp_block_two(r, b, "limits", limit);
    if (!good || locals.count < 1 || (kmp_yaml_get(b->map, "values") && !kmp_block_two(r, b, "values", value)))
        return;
    if (limit[0].value >= limit[1].value)
        kmp_reader_complain(r, b->map->place, "limits of %s: the first one, %g, must be below the second one, %g",
                            b->what, limit[0].value, limit[1].value);
    kmp_block_local(&locals, "a", kmp_block_number(r, &limit[0]));
    kmp_block_local(&locals, "b", kmp_block_number(r, &limit[1]));
    kmp_block_local(&locals, "low", kmp_block_number(r, &value[0]));
    kmp_block_local(&locals, "high", kmp_block_number(r, &value[1]));
    kmp_state *state = &r->model->states[b->first];
    state->next = kmp_block_formula(r, "if(2*x > a + b, high, low)", &locals);
    const kmp_expr *out = kmp_block_formula(r, "if((x - a)*(x - b) > 0, 0, 0)", &locals);
    b->rate[0] = out;
    state->settles = true;
    if (!kmp_yaml_get(b->map, "start"))
        state->start = value[0];
}

const kmp_block_kind kmp_block_hysteresis = {"hysteresis", " limits values ", one_state, NULL, read_hysteresis};
static const kmp_block_kind by_rate = {"rate", "", one_state, NULL, read_rate},
                            by_next = {"next", " sample when ", one_state, NULL, read_next};

static const kmp_block_kind *const kinds[] = {
    &by_rate, &by_next, &kmp_block_transfer, &kmp_block_pid, &kmp_block_hysteresis, &kmp_block_delay};

/* -- entries ----------------------------------------------------------------------------------------- */

/* The kind of an entry; NULL after an error. */
static const kmp_block_kind *kind_of(kmp_reader *r, const kmp_function_block *b)
{
    static const char *const words[] = {"rate", "next", "transfer", "pid", "hysteresis", "delay"};
    int first = -1, count = kmp_count_keys(b->map, KMP_NAMES_OF(words), &first);
    bool discrete = kmp_yaml_get(b->map, "sample") || kmp_yaml_get(b->map, "when");
    if (count > 1)
        kmp_complain_keys(r, b->map->place, b->what, KMP_NAMES_OF(words), count);
    else if (count == 0)
        (void)kmp_read_required(r, b->map, b->what, discrete ? "next" : "rate");
    return count == 1 ? kinds[first] : NULL;
}

static void add_motion(kmp_reader *r, const kmp_state *state)
{
    kempe_model *model = r->model;
    kmp_motion *motions = kmp_arena_room(&model->arena, model->motions, model->motion_count, sizeof *motions);
    if (!motions)
        return;
    model->motions = motions;
    motions[model->motion_count++] = (kmp_motion){.name = state->name, .rotation = true, .axis = {1, 0, 0}};
}

static const char *name_of(kmp_reader *r, const kmp_function_block *b, int i)
{
    if (i == 0 && !b->direct)
        return b->name;
    if (b->kind && b->kind->suffix)
        return kmp_arena_printf(&r->model->arena, "%s.%s", b->name, b->kind->suffix(b, i));
    return kmp_arena_printf(&r->model->arena, "%s.%d", b->name, i + 1);
}

static void add_state(kmp_reader *r, const char *name, kmp_place place)
{
    kempe_model *model = r->model;
    kmp_state *states = kmp_arena_room(&model->arena, model->states, model->state_count, sizeof *states);
    if (!states || !name)
        return;
    model->states = states;
    states[model->state_count] = (kmp_state){.name = name, .place = place, .scale = 1, .period = INFINITY};
    add_motion(r, &states[model->state_count]);
    model->state_count++;
}

/* The first state, or the first one of the block, begins at `start`. */
static void read_common(kmp_reader *r, const kmp_function_block *b)
{
    const kmp_yaml *start = kmp_yaml_get(b->map, "start"), *node = kmp_yaml_get(b->map, "scale"),
                   *sample = kmp_yaml_get(b->map, "sample");
    kmp_state *state = &r->model->states[b->first];
    if (start)
        (void)kmp_read_number(r, start, kmp_reader_say(r, "start of %s", b->what), KMP_DIM_ANY, &state->start);
    const char *of = kmp_reader_say(r, "scale of %s", b->what);
    double scale = state->start.value != 0 ? fabs(state->start.value) : 1, period = INFINITY;
    if (node && kmp_read_fixed(r, node, of, KMP_DIM_ANY, &scale))
        (void)kmp_check_rule(r, node, of, KMP_FIELD_POSITIVE, scale, "");
    state->scale = scale > 0 ? scale : 1;
    of = kmp_reader_say(r, "sample of %s", b->what);
    if (sample && kmp_read_fixed(r, sample, of, kmp_key_dimension(keys, "sample"), &period))
        (void)kmp_check_rule(r, sample, of, KMP_FIELD_POSITIVE, period, "");
    for (int i = 0; i < b->count; i++)
        r->model->states[b->first + i].period = period;
}

static void add_block(kmp_reader *r, const kmp_section *s)
{
    kmp_function_block *b = &r->blocks[r->block_count++];
    *b = (kmp_function_block){
        .map = s->node, .name = s->name ? s->name : "", .what = s->what, .place = s->key->place, .output = -1};
    if (kmp_read_map(r, b->map, b->what, keys))
        b->kind = kind_of(r, b);
    for (int k = 0; b->kind && k < b->map->count; k++) {
        const char *key = b->map->keys[k]->text;
        bool own = strcmp(key, b->kind->key) == 0 || strcmp(key, "start") == 0 || strcmp(key, "scale") == 0;
        if (!own && !strstr(b->kind->keys, kmp_reader_say(r, " %s ", key)))
            kmp_reader_complain(r, b->map->keys[k]->place, "%s: '%s' is no key of a state with '%s'", b->what, key,
                                b->kind->key);
    }
    b->sampled = b->kind && kmp_yaml_get(b->map, "sample");
    b->count = b->kind ? b->kind->count(r, b) : 1;
    b->rate = KMP_ARENA_NEW(&r->scratch, const kmp_expr *, b->count);
    b->first = r->model->state_count;
    for (int i = 0; i < b->count && !r->model->arena.failed; i++)
        add_state(r, name_of(r, b, i), b->place);
    if (b->direct) {
        /* The value of a block is a variable of the model, before the algebraic ones. */
        b->output = r->model->unknowns_count;
        r->model->unknowns[r->model->unknowns_count++] = (kmp_unknowns){.name = b->name, .block = true};
    }
    if (b->kind && !r->model->arena.failed && b->count > 0)
        read_common(r, b);
}

void kmp_read_states(kmp_reader *r)
{
    kempe_model *model = r->model;
    kmp_section s = kmp_read_section(r, "states", "state");
    const kmp_yaml *map = kmp_yaml_get(r->root, "algebraic");
    int algebraic = map && map->kind == KMP_YAML_MAP ? map->count : 0;
    model->unknowns = KMP_ARENA_NEW(&model->arena, kmp_unknowns, s.count + algebraic);
    r->blocks = KMP_ARENA_NEW(&r->scratch, kmp_function_block, s.count);
    while (model->unknowns && r->blocks && kmp_section_next(&s)) {
        kmp_place place = s.key->place;
        const char *name = s.name;
        if (kmp_name_means_something(r, name))
            kmp_reader_complain(r, place, "a state cannot have the name '%s', which is already defined", name);
        else if (kmp_name_find(KMP_COORDINATES(r->model), name) >= 0)
            kmp_reader_complain(r, place, "a state cannot have the name '%s', which is that of a coordinate", name);
        add_block(r, &s);
    }
    /* Each contact whose law depends on the rate at its beginning has a state. These are the last states. */
    const kmp_yaml *contacts = kmp_yaml_get(r->root, "contacts");
    r->first_contact_state = r->model->state_count;
    for (int k = 0; contacts && contacts->kind == KMP_YAML_MAP && k < contacts->count; k++)
        if (kmp_contact_keeps_rate(contacts->items[k]))
            add_state(r, kmp_arena_printf(&r->model->arena, "%s.impact", contacts->keys[k]->text),
                      contacts->keys[k]->place);
    r->first_algebraic = model->unknowns_count;
}

/* -- laws -------------------------------------------------------------------------------------------- */

/* The reader's scope is that of the expression that needs the block. */
static void read_block(kmp_reader *r, kmp_function_block *b)
{
    int scope = r->scope, line = r->scope_line;
    const kmp_expr_locals *locals = r->locals;
    r->locals = NULL;
    b->progress = KMP_BLOCK_BEGUN;
    r->block_level++;
    if (b->kind && b->rate && !r->model->arena.failed)
        b->kind->read(r, b);
    r->block_level--;
    b->progress = KMP_BLOCK_READ;
    r->scope = scope;
    r->scope_line = line;
    r->locals = locals;
}

void kmp_read_block_of(kmp_reader *r, int unknown)
{
    for (int k = 0; unknown < r->first_algebraic && k < r->block_count; k++) {
        kmp_function_block *b = &r->blocks[k];
        if (b->output != unknown || b->progress == KMP_BLOCK_READ)
            continue;
        if (b->progress == KMP_BLOCK_BEGUN)
            kmp_reader_complain(r, b->place, "%s: its value depends on itself without a state in between", b->what);
        else if (r->block_level >= MOST_NESTED_BLOCKS)
            kmp_reader_complain(r, b->place, "%s: more than %d blocks depend on each other at once", b->what,
                                MOST_NESTED_BLOCKS);
        else
            read_block(r, b);
    }
}

static void add_rate(kmp_reader *r, int k, const kmp_expr *rate)
{
    kempe_model *model = r->model;
    model->forces[model->force_count++] = (kmp_force){.name = model->states[k].name,
                                                      .kind = KMP_FORCE_STATE,
                                                      .place = model->states[k].place,
                                                      .motion = kmp_model_coordinates(model) + k,
                                                      .effort = rate};
}

void kmp_add_state_rates(kmp_reader *r)
{
    for (int k = 0; k < r->block_count; k++) {
        kmp_function_block *b = &r->blocks[k];
        if (b->progress == KMP_BLOCK_WAITS)
            read_block(r, b);
        for (int i = 0; b->rate && !r->model->arena.failed && i < b->count; i++)
            add_rate(r, b->first + i, b->rate[i]);
    }
    for (int k = r->first_contact_state; k < r->model->state_count; k++)
        add_rate(r, k, zero(r));
}
