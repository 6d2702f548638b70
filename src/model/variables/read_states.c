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

static void check_name(kmp_reader *r, const kmp_state *state)
{
    if (kmp_name_means_something(r, state->name))
        kmp_reader_complain(r, state->place, "a state cannot have the name '%s', which is already defined",
                            state->name);
    else if (kmp_name_find(KMP_COORDINATES(r->model), state->name) >= 0)
        kmp_reader_complain(r, state->place, "a state cannot have the name '%s', which is that of a coordinate",
                            state->name);
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

void kmp_read_states(kmp_reader *r)
{
    kempe_model *model = r->model;
    kmp_section s = kmp_read_section(r, "states", "state");
    model->states = KMP_ARENA_NEW(&model->arena, kmp_state, s.count);
    r->state_nodes = KMP_ARENA_NEW(&r->scratch, const kmp_yaml *, s.count);
    while (model->states && r->state_nodes && kmp_section_next(&s)) {
        kmp_state *state = &model->states[model->state_count];
        *state = (kmp_state){.name = s.name, .place = s.key->place};
        check_name(r, state);
        r->state_nodes[model->state_count] = s.node;
        add_motion(r, state);
        model->state_count++;
        read_state(r, s.node, s.what, state);
    }
}

/* A state has one of them. */
static const char *const ways[] = {"rate", "sample", "when"};

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
    const kmp_yaml *rate = kmp_read_required(r, map, what, "rate");
    return rate ? kmp_read_expr(r, rate, kmp_reader_say(r, "rate of %s", what), KMP_DIM_ANY, KMP_OF_LOADS) : NULL;
}

void kmp_add_state_rates(kmp_reader *r)
{
    kempe_model *model = r->model;
    for (int k = 0; k < model->state_count; k++) {
        kmp_state *state = &model->states[k];
        const char *what = kmp_reader_say(r, "state '%s'", state->name);
        model->forces[model->force_count++] = (kmp_force){.name = state->name,
                                                          .kind = KMP_FORCE_STATE,
                                                          .place = state->place,
                                                          .motion = kmp_model_coordinates(model) + k,
                                                          .effort = read_rate(r, r->state_nodes[k], what, state)};
    }
}
