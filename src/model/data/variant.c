/* SPDX-License-Identifier: BSD-3-Clause */
/* Copies the parts of a model that contain numbers; each changed number keeps its expression and is evaluated again
 * when parameters are set. Dependent parameters are ordered by repeated passes over all of them. */
#include "model/data/variant.h"
#include "base/context.h"
#include "base/memory.h"
#include "model/data/bushing_matrix.h"
#include "model/data/closure_table.h"
#include "model/data/gear.h"
#include "model/data/model.h"
#include "model/data/numbers.h"
#include "model/data/rope.h"
#include "model/data/tyre.h"
#include "model/language/expression_value.h"
#include <math.h>
#include <string.h>

/* A changed number of the copy, and its expression. */
typedef struct follower {
    kmp_number *number;
    const kmp_expr *expr;
} follower;

struct kmp_variant {
    kempe_model model; /* its arena holds the variant's own data */
    const kempe_model *base;
    kempe_model *owned;    /* the base; NULL: the caller frees it */
    int count, *parameter; /* by name: which parameter it is */
    double *values;        /* of all parameters */
    bool inputs;           /* names may be of inputs */
    int follower_count;
    follower *followers; /* NULL while they are counted */
};

static bool is_varying(const kmp_expr *expr, const void *model)
{
    const kempe_model *m = model;
    if (expr->kind == KMP_EXPR_INPUT)
        return m->constants && m->constants[expr->index] > 0 && m->parameters[m->constants[expr->index] - 1].varies;
    return expr->kind == KMP_EXPR_PARAMETER && m->parameters[expr->index].varies;
}

bool kmp_expr_varies(const kempe_model *model, const kmp_expr *expr)
{
    return kmp_expr_find(expr, is_varying, model);
}

/* -- the copy ---------------------------------------------------------------------------------------- */

static void *copy(kmp_variant *v, const void *from, size_t count, size_t size, size_t more)
{
    void *to = kmp_arena_alloc(&v->model.arena, count + more, size);
    if (to && count > 0)
        memcpy(to, from, count * size);
    return to;
}

#define COPY(v, from, count, more) copy((v), (from), (size_t)(count), sizeof *(from), (size_t)(more))

static void copy_closures(kmp_variant *v)
{
    kempe_model *m = &v->model;
    m->closures = COPY(v, m->closures, m->closure_count, 0);
    for (int c = 0; m->closures && c < m->closure_count; c++) {
        kmp_closure *closure = &m->closures[c];
        if (closure->terms)
            closure->terms = COPY(v, closure->terms, closure->term_count, 0);
        if (closure->constant)
            closure->constant = COPY(v, closure->constant, 1, 0);
        if (closure->gear)
            closure->gear = COPY(v, closure->gear, 1, 0);
    }
}

static void copy_numbers(kmp_variant *v, kmp_flexible *flexible)
{
    kmp_number *numbers = flexible ? COPY(v, flexible->numbers, flexible->number_count, 0) : NULL;
    if (numbers && (flexible->stations || flexible->station_count == 0))
        kmp_flexible_lay(flexible, numbers);
}

static void copy_flexibles(kmp_variant *v)
{
    kempe_model *m = &v->model;
    m->flexibles = COPY(v, m->flexibles, m->flexible_count, 0);
    for (int i = 0; m->flexibles && i < m->flexible_count; i++) {
        kmp_flexible *flexible = &m->flexibles[i];
        flexible->stations = COPY(v, flexible->stations, flexible->station_count, 0);
        copy_numbers(v, flexible);
        for (int k = 0; flexible->stations && k < flexible->station_count; k++)
            if (flexible->stations[k].beyond) {
                kmp_flexible *beyond = COPY(v, flexible->stations[k].beyond, 1, 0);
                flexible->stations[k].beyond = beyond;
                copy_numbers(v, beyond);
            }
    }
}

/* -- variable parameters ----------------------------------------------------------------------------- */

int kmp_parameter_find(const kempe_model *model, const char *name)
{
    return kmp_name_find(KMP_NAMED(model, parameter), name);
}

/* A start value becomes a parameter of its column's name. -1: no memory. */
static int add_start(kmp_variant *v, const char *name, bool rate, int motion)
{
    kempe_model *m = &v->model;
    const kmp_expr *e = kmp_expr_make(&m->arena, (kmp_expr){.kind = KMP_EXPR_PARAMETER, .index = m->parameter_count});
    const char *kept = kmp_arena_strdup(&m->arena, name);
    kmp_number *number = rate ? &m->start.qd[motion] : &m->start.q[motion];
    if (!e || !kept)
        return -1;
    m->parameters[m->parameter_count] = (kmp_parameter){.name = kept, .number = {.value = number->value}};
    number->expr = e;
    (rate ? m->start.qd_given : m->start.q_given)[motion] = true;
    return m->parameter_count++;
}

/* A parameter takes the place of a constant input. -1: no memory. */
static int add_input(kmp_variant *v, int input)
{
    kempe_model *m = &v->model;
    const kmp_model_input *of = &m->inputs[input];
    if (!m->constants)
        m->constants = KMP_ARENA_NEW(&m->arena, int, m->input_count);
    if (!m->constants)
        return -1;
    m->parameters[m->parameter_count] = (kmp_parameter){
        .name = of->name, .number = {.value = kmp_signal_value(&of->signal, 0)}, .dimension = of->dimension};
    m->constants[input] = ++m->parameter_count;
    return m->parameter_count - 1;
}

/* The meaning of a name: a parameter, or the coordinate or state whose start value or rate it is, or an input; the
 * others are -1. */
typedef struct meaning {
    int parameter, motion;
    bool rate;
    int input;
} meaning;

static meaning look_up(const kempe_model *m, const char *name)
{
    bool rate = strncmp(name, "qd.", 3) == 0, start = rate || strncmp(name, "q.", 2) == 0;
    meaning found = {kmp_parameter_find(m, name), -1, rate, -1};
    if (found.parameter < 0 && start)
        found.motion = kmp_name_find(KMP_COORDINATES(m), name + (rate ? 3 : 2));
    int state =
        found.parameter < 0 && strncmp(name, "state.", 6) == 0 ? kmp_name_find(KMP_NAMED(m, state), name + 6) : -1;
    if (found.parameter < 0 && found.motion < 0)
        found.input = kempe_model_input_find(m, name);
    return state < 0 ? found : (meaning){-1, kmp_model_coordinates(m) + state, true, -1};
}

bool kmp_variant_may(const kempe_model *m, const char *name, kmp_text *why)
{
    meaning found = look_up(m, name);
    bool start = strncmp(name, "qd.", 3) == 0 || strncmp(name, "q.", 2) == 0;
    if (found.parameter < 0 && found.motion < 0) {
        const char *own = start ? strchr(name, '.') + 1 : name;
        kmp_nearest nearest = kmp_nearest_of(own, start ? KMP_COORDINATES(m) : KMP_NAMED(m, parameter));
        kmp_text_printf(why, "the model has no %s '%s'", start ? "coordinate" : "parameter", own);
        kmp_nearest_suggest(&nearest, why);
    } else if (found.parameter >= 0 && m->parameters[found.parameter].fixed) {
        kmp_text_printf(why,
                        "parameter '%s' cannot be a variable of the equations: an axis, table, track, power or setting "
                        "of the run depends on it; use one model for each value",
                        name);
    }
    return why->length == 0;
}

kmp_dimension kmp_variant_dimension(const kempe_model *m, const char *name)
{
    const meaning found = look_up(m, name);
    if (found.parameter >= 0)
        return m->parameters[found.parameter].dimension;
    if (found.input >= 0)
        return m->inputs[found.input].dimension;
    if (found.motion < 0 || found.motion >= kmp_model_coordinates(m))
        return KMP_DIM_ANY;
    const bool rotation = m->motions[found.motion].rotation;
    kmp_dimension dimension = KMP_DIM(rotation ? 0 : 1, 0, found.rate ? -1 : 0);
    dimension.angle = rotation;
    return dimension;
}

static kempe_status mark(kmp_variant *v, int k, const char *name)
{
    kempe_model *m = &v->model;
    kmp_text why = {0};
    meaning found = look_up(m, name);
    if (v->inputs && found.input >= 0 && m->inputs[found.input].signal.count > 1)
        return kmp_fail(m->context, KEMPE_E_ARGUMENT,
                        "input '%s' has samples: only a constant input has a derivative by its value", name);
    if (!(v->inputs && found.input >= 0) && !kmp_variant_may(m, name, &why))
        return kmp_fail_text(m->context, KEMPE_E_ARGUMENT, &why);
    int at = found.parameter >= 0 ? found.parameter
             : found.input >= 0   ? add_input(v, found.input)
                                  : add_start(v, name, found.rate, found.motion);
    KMP_TRY(kmp_made(m->context, at >= 0));
    if (m->parameters[at].varies)
        return kmp_fail(m->context, KEMPE_E_ARGUMENT, "'%s' is given twice", name);
    m->parameters[at].varies = true;
    m->parameters[at].number.expr = NULL;
    v->parameter[k] = at;
    return KEMPE_OK;
}

static bool is_waited_for(const kmp_expr *e, const void *waits)
{
    return e->kind == KMP_EXPR_PARAMETER && ((const bool *)waits)[e->index];
}

/* -- dependent numbers ------------------------------------------------------------------------------- */

static bool follow(void *user, const kmp_number *number, const char *owner, const char *key, const char *part)
{
    (void)owner, (void)key, (void)part;
    kmp_variant *v = user;
    if (kmp_expr_varies(&v->model, number->expr)) {
        if (v->followers)
            v->followers[v->follower_count] = (follower){(kmp_number *)number, number->expr}; /* of its copy */
        v->follower_count++;
    }
    return true;
}

/* Finds them, or counts them first; a closure's number may be a function of time. */
static void find_followers(kmp_variant *v)
{
    kempe_model *m = &v->model;
    v->follower_count = 0;
    (void)kmp_numbers_visit(m, follow, v);
    for (int k = 0; k < m->closure_count; k++) {
        kmp_closure *c = &m->closures[k];
        if (!kmp_closure_number_of(c->kind) || !kmp_expr_varies(m, c->function))
            continue;
        if (v->followers)
            v->followers[v->follower_count] = (follower){&c->number, c->function};
        v->follower_count++;
    }
}

/* -- construction ------------------------------------------------------------------------------------ */

static kempe_status make(kmp_variant *v, int count, const char *const *names)
{
    kempe_model *m = &v->model;
    KMP_TRY(kmp_made(m->context, !m->arena.failed));
    for (int k = 0; k < count; k++)
        KMP_TRY(mark(v, k, names[k]));
    m->led = KMP_ARENA_NEW(&m->arena, int, m->parameter_count);
    m->led_count = 0;
    v->values = KMP_ARENA_NEW(&m->arena, double, m->parameter_count);
    KMP_TRY(kmp_made(m->context, !m->arena.failed));
    for (int k = 0; k < m->parameter_count; k++)
        v->values[k] = m->parameters[k].number.value;
    /* Parameters that depend on variable ones vary too; finds their order, which has no cycle. */
    bool *requested = KMP_NEW(bool, m->parameter_count), grew = true;
    KMP_TRY(kmp_made(m->context, requested));
    for (int k = 0; k < count; k++)
        requested[v->parameter[k]] = true;
    while (grew) {
        grew = false;
        for (int k = 0; k < m->parameter_count; k++)
            if (!m->parameters[k].varies && kmp_expr_varies(m, m->parameters[k].number.expr))
                grew = m->parameters[k].varies = true;
    }
    for (int k = 0; k < m->parameter_count; k++)
        requested[k] = m->parameters[k].varies && !requested[k]; /* now: waits for others */
    for (grew = true; grew;) {
        grew = false;
        for (int k = 0; k < m->parameter_count; k++)
            if (requested[k] && !kmp_expr_find(m->parameters[k].number.expr, is_waited_for, requested)) {
                requested[k] = false;
                m->led[m->led_count++] = k;
                grew = true;
            }
    }
    kmp_free(requested);
    find_followers(v);
    v->followers = KMP_ARENA_NEW(&m->arena, follower, v->follower_count);
    KMP_TRY(kmp_made(m->context, v->followers));
    find_followers(v);
    return KEMPE_OK;
}

static kempe_status new_variant(kempe_context *context, const kempe_model *model, int count, const char *const *names,
                                bool inputs, kmp_variant **variant)
{
    KMP_TRY(kmp_model_check_finished(model));
    KMP_MAKE(context, kmp_variant, v);
    /* Shares all parts of the model without numbers. */
    kempe_model *m = &v->model;
    *m = *model;
    m->arena = (kmp_arena){0};
    m->source.has_digest = false; /* its numbers are its own */
    m->variant = NULL;
    int n = m->motion_count;
    m->parameters = COPY(v, m->parameters, m->parameter_count, count);
    m->motions = COPY(v, m->motions, n, 0);
    m->bodies = COPY(v, m->bodies, m->body_count, 0);
    m->points = COPY(v, m->points, m->point_count, 0);
    m->forces = COPY(v, m->forces, m->force_count, 0);
    for (int k = 0; m->forces && k < m->force_count; k++)
        if (m->forces[k].matrix)
            m->forces[k].matrix = COPY(v, m->forces[k].matrix, 1, 0);
    m->bearings = COPY(v, m->bearings, m->bearing_count, 0);
    m->wheels = COPY(v, m->wheels, m->wheel_count, 0);
    m->roads = COPY(v, m->roads, m->road_count, 0);
    m->tyres = COPY(v, m->tyres, m->tyre_count, 0);
    m->states = COPY(v, m->states, m->state_count, 0);
    copy_closures(v);
    m->ropes = COPY(v, m->ropes, m->rope_count, 0);
    for (int k = 0; m->ropes && k < m->rope_count; k++)
        m->ropes[k].places = COPY(v, m->ropes[k].places, m->ropes[k].count, 0);
    copy_flexibles(v);
    m->start.q = COPY(v, m->start.q, n, 0);
    m->start.qd = COPY(v, m->start.qd, n, 0);
    m->start.q_given = COPY(v, m->start.q_given, n, 0);
    m->start.qd_given = COPY(v, m->start.qd_given, n, 0);
    m->cut_coordinates = COPY(v, m->cut_coordinates, m->cut_coordinate_count, 0);
    m->start.goals = COPY(v, m->start.goals, m->start.goal_count, 0);
    v->model.context = context;
    v->base = model;
    v->count = count;
    v->parameter = KMP_ARENA_NEW(&v->model.arena, int, count);
    v->inputs = inputs;
    kempe_status status = make(v, count, names);
    return KMP_GIVE_OR_FREE(status, variant, v, kmp_variant_free);
}

kempe_status kmp_variant_new(const kempe_model *model, int count, const char *const *names, kmp_variant **variant)
{
    return new_variant(model->context, model, count, names, false, variant);
}

kempe_status kmp_variant_new_with_inputs(const kempe_model *model, int count, const char *const *names,
                                         kmp_variant **variant)
{
    return new_variant(model->context, model, count, names, true, variant);
}

kempe_status kmp_variant_new_in(kempe_context *context, const kempe_model *model, int count, const char *const *names,
                                kmp_variant **variant)
{
    return new_variant(context, model, count, names, false, variant);
}

/* A state has a motion, and its rate is a force: both are behind all others (model/data/state.h). */
kempe_status kmp_variant_add_states(kmp_variant *v, int count, const char *const *names, const kmp_expr *const *rates)
{
    kempe_model *m = &v->model;
    const int n = m->motion_count, coordinates = kmp_model_coordinates(m);
    m->motions = COPY(v, m->motions, n, count);
    m->states = COPY(v, m->states, m->state_count, count);
    m->forces = COPY(v, m->forces, m->force_count, count);
    m->start.q = COPY(v, m->start.q, n, count);
    m->start.qd = COPY(v, m->start.qd, n, count);
    m->start.q_given = COPY(v, m->start.q_given, n, count);
    m->start.qd_given = COPY(v, m->start.qd_given, n, count);
    m->start.hold = COPY(v, m->start.hold, n, count);
    if (m->start.undeformed)
        m->start.undeformed = COPY(v, m->start.undeformed, n, count);
    KMP_TRY(kmp_made(m->context, !m->arena.failed));
    for (int k = 0; k < count; k++) {
        m->start.qd_given[m->motion_count] = true;
        m->motions[m->motion_count++] = (kmp_motion){.name = names[k], .rotation = true, .axis = {1, 0, 0}};
        m->forces[m->force_count++] = (kmp_force){
            .name = names[k], .kind = KMP_FORCE_STATE, .motion = coordinates + m->state_count, .effort = rates[k]};
        m->states[m->state_count++] = (kmp_state){.name = names[k], .scale = 1, .period = INFINITY};
    }
    find_followers(v); /* their numbers are in other places now */
    return KEMPE_OK;
}

void kmp_variant_free(kmp_variant *v)
{
    if (!v)
        return;
    kempe_model *owned = v->owned;
    kmp_arena_free(&v->model.arena);
    kmp_free(v);
    kempe_model_free(owned);
}

void kmp_variant_own(kmp_variant *variant, kempe_model *model)
{
    variant->owned = model;
}

kempe_model *kmp_variant_model(kmp_variant *variant)
{
    return &variant->model;
}

/* -- values ------------------------------------------------------------------------------------------ */

static void check_force(const kmp_force *force, kmp_text *why)
{
    for (int f = 0; f < kmp_force_field_count; f++) {
        const kmp_force_field *field = &kmp_force_fields[f];
        bool has = field->kind == force->kind && kmp_force_has(force, f);
        for (int i = 0; has && i < field->size; i++) {
            double x = kmp_force_get(force, f)[i].value;
            if (!kmp_field_fits(field->rule, x) && !why->length)
                kmp_text_printf(why, "force '%s': %s is %.6g", force->name, field->key, x);
        }
    }
    for (int i = 0; force->matrix && i < KMP_BUSHING_KINDS; i++) {
        const int entry = kmp_bushing_uneven(force->matrix, (kmp_bushing_kind)i);
        if (entry >= 0 && !why->length)
            kmp_text_printf(why, "force '%s': entries %s and %s of its %s differ, and it is not nonsymmetric",
                            force->name, kmp_bushing_entries[entry], kmp_bushing_entries[kmp_bushing_opposite(entry)],
                            kmp_bushing_keys[i]);
    }
    if (force->kind == KMP_FORCE_CYLINDER && force->rod.value >= force->bore.value && !why->length)
        kmp_text_printf(why, "force '%s': the rod, %.6g m, is not thinner than the bore, %.6g m", force->name,
                        force->rod.value, force->bore.value);
    if (force->has_lower && force->has_upper && force->lower.value >= force->upper.value && !why->length)
        kmp_text_printf(why, "force '%s': lower is %.6g, which is not below upper, %.6g", force->name,
                        force->lower.value, force->upper.value);
}

/* Numbers that a beam has, and stations on it. */
static void check_flexible(const kempe_model *m, const kmp_flexible *flexible, kmp_text *why)
{
    const char *name = m->bodies[flexible->body].name;
    const double length = flexible->length->value, rounding = 1e-12;
    bool good = length > 0 && flexible->mass->value > 0;
    for (int k = 0; k < flexible->count; k++)
        good = good && flexible->stiffness[k * (flexible->count + 1)].value > 0 &&
               flexible->damping[k * (flexible->count + 1)].value >= 0;
    if (!good && !why->length)
        kmp_text_printf(
            why, "the length, mass or stiffness of flexible body '%s' is not positive, or its damping negative", name);
    for (int k = 0; k < flexible->station_count; k++) {
        const double x = flexible->stations[k].at[0].value;
        if (!flexible->file && !(x >= 0 && x <= length * (1 + rounding)) && !why->length)
            kmp_text_printf(why, "a station of flexible body '%s' is at %.6g m, and its beam is %.6g m long", name, x,
                            length);
    }
}

/* The first rule for single numbers that the values break. */
static void check_rope(const kmp_rope *rope, kmp_text *why)
{
    for (int k = 0; k < rope->count; k++)
        if (rope->places[k].turn != 0 && !(rope->places[k].radius.value > 0) && !why->length)
            kmp_text_printf(why, "a radius of rope '%s' is %.6g: it must be positive", rope->name,
                            rope->places[k].radius.value);
    if (rope->kind == KMP_ROPE_ELASTIC && !(rope->stiffness.value > 0) && !why->length)
        kmp_text_printf(why, "the stiffness of rope '%s' is %.6g: it must be positive", rope->name,
                        rope->stiffness.value);
    if (rope->preload.value < 0 && !why->length)
        kmp_text_printf(why, "the preload of rope '%s' is %.6g: it must not be negative", rope->name,
                        rope->preload.value);
}

static void check_values(const kempe_model *m, const kempe_model *base, kmp_text *why)
{
    for (int k = 1; k < m->body_count; k++) {
        const kmp_body *b = &m->bodies[k];
        if (b->mass.value < 0 && !why->length)
            kmp_text_printf(why, "the mass of body '%s' is negative: %.6g", b->name, b->mass.value);
        if (b->armature.value < 0 && !why->length)
            kmp_text_printf(why, "the armature of joint '%s' is negative: %.6g", b->joint, b->armature.value);
        for (int i = 0; i < 3; i++)
            if (b->inertia[i].value < 0 && !(base->bodies[k].inertia[i].value < 0) && !why->length) /* as given, then */
                kmp_text_printf(why, "the inertia of body '%s' is impossible: %s = %.6g is negative", b->name,
                                kmp_inertia_names[i], b->inertia[i].value);
    }
    for (int k = 0; k < m->flexible_count; k++)
        check_flexible(m, &m->flexibles[k], why);
    for (int k = 0; k < m->force_count; k++)
        check_force(&m->forces[k], why);
    for (int k = 0; k < m->closure_count; k++) {
        const kmp_closure *c = &m->closures[k];
        const kmp_closure_number *own = kmp_closure_number_of(c->kind);
        if (own && !kmp_field_fits(own->rule, c->number.value) && !why->length)
            kmp_text_printf(why, "the %s of closure '%s' is %.6g: it must %s", own->key, c->name, c->number.value,
                            kmp_field_rule_words(own->rule));
        for (int i = 0; i < c->term_count; i++)
            if (c->terms[i].factor.value == 0 && !why->length)
                kmp_text_printf(why, "closure '%s': the factor of '%s' is zero", c->name,
                                m->motions[c->terms[i].motion].name);
        for (int i = 0; c->gear && i < KMP_GEAR_NUMBERS; i++)
            if (kmp_gear_has(c->gear, (kmp_gear_number)i) && !(c->gear->number[i].value > 0) && !why->length)
                kmp_text_printf(why, "the %s of gear '%s' is %.6g: it must be positive", kmp_gear_number_keys[i],
                                c->name, c->gear->number[i].value);
    }
    for (int k = 0; k < m->rope_count; k++)
        check_rope(&m->ropes[k], why);
    for (int k = 0; k < m->state_count; k++)
        if (base->states[k].delay.value > 0 && !(m->states[k].delay.value > 0) && !why->length)
            kmp_text_printf(why, "the delay of '%s' is %.6g s: a positive time is expected", m->states[k].name,
                            m->states[k].delay.value);
    for (int k = 0; k < m->start.goal_count; k++) {
        const kmp_goal *goal = &m->start.goals[k];
        for (int i = 0; i < goal->width; i++)
            if (goal->weight[i].value < 0 && !why->length)
                kmp_text_printf(why, "the weight of a goal is %.6g: it must not be negative", goal->weight[i].value);
    }
}

kempe_status kmp_variant_set(kmp_variant *v, const double *values, kmp_text *why)
{
    kempe_model *m = &v->model;
    for (int k = 0; k < v->count; k++)
        v->values[v->parameter[k]] = values[k];
    for (int k = 0; k < m->led_count; k++)
        v->values[m->led[k]] = kmp_expr_value(m->parameters[m->led[k]].number.expr, v->values);
    for (int k = 0; k < m->parameter_count; k++) {
        m->parameters[k].number.value = v->values[k];
        if (!isfinite(v->values[k]) && !why->length)
            kmp_text_printf(why, "parameter '%s' is %s: a finite number is expected", m->parameters[k].name,
                            isnan(v->values[k]) ? "not a number" : "infinite");
    }
    for (int k = 0; k < v->follower_count; k++) {
        const follower *f = &v->followers[k];
        double x = kmp_expr_value_of(f->expr, v->values, m->constants, 0);
        f->number->value = x;
        if (!isfinite(x) && !why->length)
            kmp_text_put(why, "a number of the model is not finite with these parameters");
    }
    check_values(&v->model, v->base, why);
    return why->failed ? kmp_fail_memory(v->model.context) : why->length == 0 ? KEMPE_OK : KEMPE_E_INPUT;
}

/* -- instances --------------------------------------------------------------------------------------- */

kempe_status kmp_variant_instance(const kempe_model *model, int count, const char *const *names, const double *values,
                                  kempe_model **instance)
{
    kmp_variant *v = NULL;
    kmp_text why = {0};
    KMP_TRY(kmp_variant_new(model, count, names, &v));
    kempe_status status = count > 0 ? kmp_variant_set(v, values, &why) : KEMPE_OK;
    if (status == KEMPE_E_INPUT)
        status = kmp_fail_text(model->context, KEMPE_E_FAILED, &why);
    kmp_text_free(&why);
    kempe_model *m = &v->model;
    for (int k = 0; k < m->parameter_count; k++)
        m->parameters[k].varies = false; /* its values now belong to the model */
    m->led_count = 0;
    m->variant = v;
    return KMP_GIVE_OR_FREE(status, instance, m, kempe_model_free);
}
