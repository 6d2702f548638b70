/* SPDX-License-Identifier: BSD-3-Clause */
/* States: their names and motions before any expression is read that may contain them, their rates after all that those
 * may contain. */
#include "model/read/reading.h"
#include <math.h>

static const kmp_key keys[] = {
#include "model/keys/state_keys.def"
    {0}};

static void add_motion(kmp_reader *r, const kmp_state *state)
{
    kempe_model *model = r->model;
    kmp_motion *motions = kmp_arena_room(&model->arena, model->motions, model->motion_count, sizeof *motions);
    if (!motions)
        return;
    model->motions = motions;
    motions[model->motion_count++] = (kmp_motion){.name = state->name, .rotation = true, .axis = {1, 0, 0}};
}

static void check_name(kmp_reader *r, kmp_place place, const char *name)
{
    if (kmp_name_means_something(r, name))
        kmp_reader_complain(r, place, "a state cannot have the name '%s', which is already defined", name);
    else if (kmp_name_find(KMP_COORDINATES(r->model), name) >= 0)
        kmp_reader_complain(r, place, "a state cannot have the name '%s', which is that of a coordinate", name);
}

static void read_scale(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_state *state)
{
    const char *of = kmp_reader_say(r, "scale of %s", what);
    double scale = state->start.value != 0 ? fabs(state->start.value) : 1;
    if (node && kmp_read_fixed(r, node, of, KMP_DIM_ANY, &scale))
        (void)kmp_check_rule(r, node, of, KMP_FIELD_POSITIVE, scale, "");
    state->scale = scale > 0 ? scale : 1;
}

static void read_state(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_state *state)
{
    bool good = kmp_read_map(r, map, what, keys);
    const kmp_yaml *start = good ? kmp_yaml_get(map, "start") : NULL;
    if (start)
        (void)kmp_read_number(r, start, kmp_reader_say(r, "start of %s", what), KMP_DIM_ANY, &state->start);
    read_scale(r, good ? kmp_yaml_get(map, "scale") : NULL, what, state);
}

static kmp_state *add_state(kmp_reader *r, const kmp_section *s, const char *name)
{
    kempe_model *model = r->model;
    kmp_state *state = &model->states[model->state_count];
    *state = (kmp_state){.name = name ? name : "", .place = s->key->place};
    r->state_nodes[model->state_count] = s->node;
    add_motion(r, state);
    model->state_count++;
    return state;
}

void kmp_read_states(kmp_reader *r)
{
    kempe_model *model = r->model;
    kmp_section s = kmp_read_section(r, "states", "state");
    int count = 0;
    for (int k = 0; k < s.count; k++)
        count += kmp_filter_order(s.map->items[k]);
    model->states = KMP_ARENA_NEW(&model->arena, kmp_state, count);
    r->state_nodes = KMP_ARENA_NEW(&r->scratch, const kmp_yaml *, count);
    while (model->states && r->state_nodes && kmp_section_next(&s)) {
        check_name(r, s.key->place, s.name);
        kmp_state *first = add_state(r, &s, s.name);
        read_state(r, s.node, s.what, first);
        for (int i = 1; i < kmp_filter_order(s.node); i++)
            add_state(r, &s, kmp_arena_printf(&model->arena, "%s.%d", s.name, i + 1))->scale = 1;
    }
}

/* A state has one of them. */
static const char *const ways[] = {"rate", "transfer", "sample", "when"};

static const kmp_expr *zero(kmp_reader *r)
{
    kmp_expr *e = KMP_ARENA_NEW(&r->model->arena, kmp_expr, 1);
    if (e)
        *e = (kmp_expr){.kind = KMP_EXPR_NUMBER};
    return e;
}

/* The rate of a state that changes where a comparison becomes true: zero in any case, so that the comparison is a
 * condition of the equations, and its changes are located. */
static const kmp_expr *read_when(kmp_reader *r, const kmp_yaml *node, const char *what)
{
    const kmp_expr *when = kmp_read_expr(r, node, kmp_reader_say(r, "when of %s", what), KMP_DIM_ANY, KMP_COMPARISON);
    kmp_expr *rate = when ? KMP_ARENA_NEW(&r->model->arena, kmp_expr, 1) : NULL;
    if (kmp_expr_lambda(when))
        kmp_reader_complain(r, node->place, "when of %s: changes of multipliers are not located", what);
    if (rate)
        *rate = (kmp_expr){.kind = KMP_EXPR_CALL, .function = KMP_FUNCTION_if, .a = when, .b = zero(r), .c = zero(r)};
    return rate;
}

/* Its next value, and the time between samples. */
static void read_sampled(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_state *state)
{
    const kmp_yaml *sample = kmp_yaml_get(map, "sample"), *next = kmp_yaml_get(map, "next");
    const char *of = kmp_reader_say(r, "sample of %s", what);
    if (sample && kmp_read_fixed(r, sample, of, kmp_key_dimension(keys, "sample"), &state->period))
        (void)kmp_check_rule(r, sample, of, KMP_FIELD_POSITIVE, state->period, "");
    state->next = kmp_read_expr(r, next, kmp_reader_say(r, "next of %s", what), KMP_DIM_ANY, KMP_OF_STATE);
    if (!sample)
        state->period = INFINITY;
}

static const kmp_expr *read_rate(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_state *state)
{
    if (map->kind != KMP_YAML_MAP)
        return NULL;
    const kmp_yaml *when = kmp_yaml_get(map, "when");
    if (kmp_yaml_get(map, "next") || kmp_yaml_get(map, "sample") || when) {
        (void)kmp_read_one_key(r, map, what, KMP_NAMES_OF(ways));
        if (kmp_read_required(r, map, what, "next"))
            read_sampled(r, map, what, state);
        return when ? read_when(r, when, what) : zero(r);
    }
    if (kmp_yaml_get(map, "rate") && kmp_yaml_get(map, "transfer"))
        (void)kmp_read_one_key(r, map, what, KMP_NAMES_OF(ways));
    const kmp_yaml *rate = kmp_read_required(r, map, what, "rate");
    return rate ? kmp_read_expr(r, rate, kmp_reader_say(r, "rate of %s", what), KMP_DIM_ANY, KMP_OF_LOADS) : NULL;
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
    kempe_model *model = r->model;
    const kmp_expr **rates = KMP_ARENA_NEW(&r->scratch, const kmp_expr *, model->state_count);
    for (int k = 0; rates && k < model->state_count;) {
        const char *what = kmp_reader_say(r, "state '%s'", model->states[k].name);
        const kmp_yaml *map = r->state_nodes[k];
        int count = kmp_filter_order(map);
        if (kmp_yaml_get(map, "transfer") && !kmp_yaml_get(map, "rate"))
            kmp_read_filter(r, map, what, k, rates);
        else
            rates[0] = read_rate(r, map, what, &model->states[k]);
        for (int i = 0; i < count; i++)
            add_rate(r, k + i, rates[i]);
        k += count;
    }
}
