/* SPDX-License-Identifier: BSD-3-Clause */
/* A copy of the model in which sampled states and delays have rates and tracks are ideal, derived as a separate
 * system. States that change at events are constants of it, unless the condition of their change is near: then they are
 * judged at the state. */
#include "analyses/derivatives/averaged.h"
#include "base/context.h"
#include "base/memory.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/inexact/nearest_exact.h"
#include "constraints/tolerances.h"
#include "dynamics/equations.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "model/data/model.h"
#include <math.h>
#include <string.h>

struct kmp_averaged {
    const kempe_system *given;
    kmp_arena arena;   /* of what is not the given model's */
    kempe_model model; /* a copy that shares the rest */
    kempe_system *system;
};

/* (next - y)/T; for a delay (u - y)/T */
static const kmp_expr *rate_of(kmp_averaged *a, const kmp_state *state, int motion)
{
    const kmp_expr *own = kmp_expr_make(&a->arena, (kmp_expr){.kind = KMP_EXPR_QD, .index = motion});
    const kmp_expr *change = kmp_expr_make(
        &a->arena, (kmp_expr){.kind = KMP_EXPR_SUB, .a = state->next ? state->next : state->delayed, .b = own});
    const kmp_expr *time = state->delay.expr;
    if (!time)
        time = kmp_expr_make(
            &a->arena, (kmp_expr){.kind = KMP_EXPR_NUMBER, .value = state->next ? state->period : state->delay.value});
    return kmp_expr_make(&a->arena, (kmp_expr){.kind = KMP_EXPR_DIV, .a = change, .b = time});
}

/* That of its comparison, which thus stays a condition, and y0 - y: the start value as a parameter, which has the name
 * that requests have for it. */
static const kmp_expr *rate_of_constant(kmp_averaged *a, const kempe_model *given, int k)
{
    kempe_model *m = &a->model;
    const int motion = kmp_model_coordinates(given) + k;
    const char *name = kmp_arena_printf(&a->arena, "state.%s", given->states[k].name);
    m->parameters[m->parameter_count] = (kmp_parameter){.name = name, .number = given->start.qd[motion]};
    const kmp_expr *value =
        kmp_expr_make(&a->arena, (kmp_expr){.kind = KMP_EXPR_PARAMETER, .index = m->parameter_count++});
    const kmp_expr *own = kmp_expr_make(&a->arena, (kmp_expr){.kind = KMP_EXPR_QD, .index = motion});
    const kmp_expr *change = kmp_expr_make(&a->arena, (kmp_expr){.kind = KMP_EXPR_SUB, .a = value, .b = own});
    return kmp_expr_make(&a->arena, (kmp_expr){.kind = KMP_EXPR_ADD, .a = kmp_state_rate(given, k), .b = change});
}

static bool copy_model(kmp_averaged *a, const kempe_model *given)
{
    kempe_model *m = &a->model;
    *m = *given;
    m->source.has_digest = false; /* its equations are others */
    m->forces = KMP_ARENA_NEW(&a->arena, kmp_force, m->force_count);
    m->states = KMP_ARENA_NEW(&a->arena, kmp_state, m->state_count);
    m->parameters = KMP_ARENA_NEW(&a->arena, kmp_parameter, m->parameter_count + m->state_count);
    if (a->arena.failed)
        return false;
    for (int k = 0; k < m->parameter_count; k++)
        m->parameters[k] = given->parameters[k];
    m->tracks = kmp_tracks_ideal(m->track_count, m->tracks, &a->arena);
    memcpy(m->forces, given->forces, (size_t)m->force_count * sizeof *m->forces);
    memcpy(m->states, given->states, (size_t)m->state_count * sizeof *m->states);
    for (int k = 0; k < m->state_count; k++)
        if (given->states[k].next || given->states[k].delayed) {
            bool constant = given->states[k].next && isinf(given->states[k].period);
            m->forces[m->force_count - m->state_count + k].effort =
                constant ? rate_of_constant(a, given, k) : rate_of(a, &given->states[k], kmp_model_coordinates(m) + k);
            m->states[k].next = m->states[k].delayed = NULL;
            m->states[k].held = constant;
        }
    return !a->arena.failed;
}

kempe_status kmp_averaged_new(const kempe_system *given, kmp_averaged **averaged)
{
    const bool irregular = kmp_tracks_are_irregular(given->model->track_count, given->model->tracks);
    *averaged = NULL;
    if (!kmp_model_has_samples(given->model) && given->model->delay_count == 0 && !irregular)
        return KEMPE_OK;
    if (irregular)
        kmp_log(given->context, KEMPE_LOG_WARNING,
                "the irregularities of tracks are left out: equilibria, steady motions and small motions are those on "
                "the ideal track");
    KMP_MAKE(given->context, kmp_averaged, a);
    a->given = given;
    kempe_status status = kmp_made(given->context, copy_model(a, given->model));
    if (status == KEMPE_OK)
        status = kmp_system_new(&a->model, NULL, &a->system);
    if (status == KEMPE_OK)
        kempe_system_set_force(a->system, given->force, given->force_user);
    return KMP_GIVE_OR_FREE(status, averaged, a, kmp_averaged_free);
}

void kmp_averaged_free(kmp_averaged *averaged)
{
    if (!averaged)
        return;
    kempe_system_free(averaged->system);
    kmp_arena_free(&averaged->arena);
    kmp_free(averaged);
}

void kmp_averaged_put(kmp_text *text, const char *label, const kmp_averaged *averaged)
{
    const kempe_model *given = averaged ? averaged->given->model : NULL;
    if (given && kmp_tracks_are_irregular(given->track_count, given->tracks))
        kmp_text_printf(text, "%swithout their irregularities\n", label);
}

const kempe_system *kmp_averaged_system(const kmp_averaged *averaged, const kempe_system *given)
{
    return averaged ? averaged->system : given;
}

/* -- states that change at events -------------------------------------------------------------------- */

/* True if a condition has another sign, or none, where a coordinate or a rate differs a little. */
static bool is_near(const kmp_linear *l, int condition, double *q)
{
    const int n = l->n;
    double *qd = q + n;
    memcpy(q, l->q, (size_t)n * sizeof *q);
    memcpy(qd, l->qd, (size_t)n * sizeof *qd);
    const double here = kmp_eval_changes(l->eval, l->t, q, qd)[condition];
    bool near = here == 0;
    for (int k = 0; !near && k < 4 * n; k++) {
        double *x = q + k / 2, kept = *x;
        *x += (k % 2 ? -1 : 1) * KMP_EVENT_HERE * l->system->scale[k / 2 % n];
        near = here * kmp_eval_changes(l->eval, l->t, q, qd)[condition] <= 0;
        *x = kept;
    }
    (void)kmp_eval_changes(l->eval, l->t, l->q, l->qd);
    return near;
}

/* The next value at the place of a state that settles; NAN: no memory. */
static double value_there(const kmp_state *state, const kmp_linear *l)
{
    const kmp_derivation_request scene = {.sets = KMP_SET_CLOSURE, .plain = true, .charted = true};
    kmp_equations eq;
    kmp_formulas f = {0};
    const kmp_instant at = kmp_linear_instant(l);
    double value = NAN;
    if (kmp_equations_derive_once(&eq, l->system->model, &scene) != KEMPE_OK) /* a variant's model has its parameters */
        return NAN;
    const kmp_ref next = kmp_tree_expression(&eq.tree, state->next);
    if (kmp_formulas_init(&f, eq.graph, 1, &next, l->eval->backend, l->system->parameters))
        value = *kmp_formulas_at(&f, &at);
    kmp_formulas_free(&f);
    kmp_equations_free(&eq);
    return value;
}

static kempe_status judge_one(const kempe_model *model, int k, const kmp_linear *l, double *room)
{
    const kmp_state *state = &model->states[k];
    const kmp_expr *comparison = kmp_state_rate(model, k)->a;
    const double value = l->qd[kmp_model_coordinates(model) + k];
    int condition = 0;
    while (condition < l->system->events.count && l->system->events.condition[condition].expr != comparison)
        condition++;
    if (!comparison || condition == l->system->events.count)
        return KEMPE_OK;
    if (is_near(l, condition, room))
        return kmp_fail(
            model->context, KEMPE_E_FAILED,
            "the state '%s' switches exactly at this point, so that no linear model exists: use another start",
            state->name);
    const double change = kmp_eval_changes(l->eval, l->t, l->q, l->qd)[condition];
    const double next = state->settles && change < 0 ? value_there(state, l) : value;
    if (isnan(next))
        return kmp_fail_memory(model->context);
    if (fabs(next - value) <= KMP_SAME_STATE * fmax(fabs(value), state->scale))
        return KEMPE_OK;
    return kmp_fail(model->context, KEMPE_E_FAILED,
                    "the state '%s' begins with %.9g, but its input requires %.9g there: give it 'start: %.9g'",
                    state->name, value, next, next);
}

kempe_status kmp_averaged_judge(const kmp_averaged *averaged, const kmp_linear *linear)
{
    if (!averaged)
        return KEMPE_OK;
    const kempe_model *model = averaged->given->model;
    double *room = KMP_NEW(double, 2 * linear->n);
    kempe_status status = kmp_made(model->context, room);
    for (int k = 0; status == KEMPE_OK && k < model->state_count; k++)
        if (averaged->model.states[k].held)
            status = judge_one(model, k, linear, room);
    kmp_free(room);
    return status;
}
