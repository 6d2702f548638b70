/* SPDX-License-Identifier: BSD-3-Clause */
/* Sampled states of the model during a run. Each takes its next value at a sample or an event, from the state of the
 * motion before any of them has changed. A sample is taken once, when the run continues from its time. */
#include "integrators/run/sampler.h"
#include "backend/machine.h"
#include "dynamics/equations.h"
#include "dynamics/kinematics/kinematics_conditions.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/touching.h"
#include "integrators/friction/friction_inside.h"
#include "integrators/run/delays.h"
#include "integrators/run/runner.h"
#include "model/data/model.h"
#include <math.h>

struct kmp_sampler {
    kmp_program *program; /* the next values of the sampled states at (t, q, qd) */
    kmp_machine *machine;
    int count;
    int *state;      /* of each: its index among the states */
    double *number;  /* of its next sample */
    int *condition;  /* whose change to true is an event of it; -1: none */
    bool *was, *due; /* the comparison was true; it has become so, and the state has not changed since */
    bool *taken;     /* it changes now */
};

static double time_of(const kmp_runner *run, int k)
{
    const kmp_sampler *x = run->sampler;
    return x->number[k] * run->s->model->states[x->state[k]].period;
}

/* INFINITY of a state without samples. */
double kmp_runner_next_sample(const kmp_runner *run)
{
    double next = INFINITY;
    for (int k = 0; run->sampler && k < run->sampler->count; k++)
        next = fmin(next, time_of(run, k));
    return next;
}

bool kmp_runner_sample_is_due(const kmp_runner *run, double t)
{
    return kmp_sample_is_due(kmp_runner_next_sample(run), t);
}

double kmp_runner_pause(const kmp_runner *run)
{
    double sample = kmp_runner_next_sample(run), piece = kmp_present_inputs_until(&run->eval->inputs);
    double pause = kmp_first_limit(sample, piece, run->spec.t_end);
    return kmp_last_equal(run->stops.at) < pause ? run->stops.at : pause;
}

/* The end of a step from t on by the functions of time. */
static double end_of_interval(const kmp_runner *run, double t)
{
    /* An end that differs from t by rounding is behind. */
    const double behind = kmp_last_equal(t), end = kmp_time_scales_end(&run->scales, behind);
    const kmp_time_scales *at_rest = &run->scales_at_rest;
    bool rests = run->events.watch_loads;
    for (int i = 0; run->sticking.friction && isfinite(at_rest->shortest) && i < run->sticking.friction->count; i++) {
        const kmp_friction_mode stance = run->sticking.friction->element[i].stance;
        rests = rests || stance == KMP_FRICTION_HELD || stance == KMP_FRICTION_CARRIED;
    }
    return !rests || isinf(at_rest->shortest)
               ? end
               : fmin(end, at_rest->open ? t + at_rest->shortest : kmp_time_scales_end(at_rest, behind));
}

double kmp_runner_limit(const kmp_runner *run, double t)
{
    double pause = kmp_runner_pause(run);
    const double end = end_of_interval(run, t);
    const double longest = run->spec.max_step > 0 ? fmin(t + run->spec.max_step, end) : end;
    return kmp_last_equal(longest) < pause ? longest : pause;
}

double kmp_runner_reach(const kmp_runner *run, double t)
{
    bool due = kmp_runner_sample_is_due(run, t) || kmp_present_inputs_are_due(&run->eval->inputs, t);
    return due ? kmp_last_equal(t) : t;
}

static int contact_of(const kmp_runner *run, int k)
{
    return run->s->model->states[run->sampler->state[k]].contact - 1;
}

/* The comparison at whose change a state changes; NULL: it is sampled, or changes with a contact. */
static const kmp_expr *comparison_of(const kmp_runner *run, int k)
{
    return kmp_state_rate(run->s->model, run->sampler->state[k])->a;
}

/* The condition of a comparison holds where its first side is less; <= and >= are then false. */
static bool is_true(const kmp_runner *run, int k)
{
    const kmp_expr *e = comparison_of(run, k);
    int condition = run->sampler->condition[k];
    bool holds = condition >= 0 && run->eval->conditions.mode[condition] > 0;
    return condition >= 0 && holds != (e && (e->kind == KMP_EXPR_AT_MOST || e->kind == KMP_EXPR_AT_LEAST));
}

static void find_conditions(kmp_runner *run)
{
    kmp_sampler *x = run->sampler;
    const kmp_events *events = &run->s->events;
    for (int k = 0; k < x->count; k++) {
        int contact = contact_of(run, k);
        x->condition[k] = contact < 0 ? -1 : kmp_events_find(events, &run->s->model->forces[contact], KMP_PRESSING);
        for (int i = 0; comparison_of(run, k) && i < events->count; i++)
            if (events->condition[i].expr == comparison_of(run, k))
                x->condition[k] = i;
    }
}

void kmp_runner_note_events(kmp_runner *run)
{
    for (int k = 0; run->sampler && k < run->sampler->count; k++)
        run->sampler->was[k] = is_true(run, k);
}

bool kmp_runner_settles(kmp_runner *run)
{
    kmp_sampler *x = run->sampler;
    bool any = false;
    for (int k = 0; x && k < x->count; k++) {
        x->due[k] = run->s->model->states[x->state[k]].settles && is_true(run, k);
        any = any || x->due[k];
    }
    return any;
}

bool kmp_runner_meets_events(kmp_runner *run)
{
    kmp_sampler *x = run->sampler;
    bool any = false;
    for (int k = 0; x && k < x->count; k++) {
        bool now = is_true(run, k);
        x->due[k] = x->due[k] || (now && !x->was[k]);
        x->was[k] = now;
        any = any || x->due[k];
    }
    return any;
}

/* Conditions in the expressions have the values of the state. */
static kempe_status make_program(kmp_sampler *x, const kempe_model *model)
{
    const kmp_derivation_request scene = {.sets = KMP_SET_CLOSURE, .plain = true, .charted = true};
    kmp_equations eq;
    KMP_TRY(kmp_equations_derive_once(&eq, model, &scene));
    kmp_ref *next = KMP_GRAPH_NEW(eq.graph, kmp_ref, x->count);
    for (int k = 0; next && k < x->count; k++)
        next[k] = kmp_tree_expression(&eq.tree, model->states[x->state[k]].next);
    const kmp_ref *const group = next;
    x->program = next && !kmp_graph_failed(eq.graph) ? kmp_program_new(eq.graph, 1, &x->count, &group) : NULL;
    kmp_equations_free(&eq);
    return x->program ? KEMPE_OK : kmp_fail_memory(model->context);
}

kempe_status kmp_runner_make_sampler(kmp_runner *run, double t)
{
    const kempe_model *model = run->s->model;
    if (!kmp_model_has_samples(model))
        return KEMPE_OK;
    kmp_sampler *x = run->sampler = KMP_ARENA_NEW(&run->arena, kmp_sampler, 1);
    KMP_TRY(kmp_made(model->context, x));
    const int room = model->state_count;
    bool made = KMP_ARENA_MAKE(&run->arena, KMP_ROOM(int, room, &x->state, &x->condition),
                               KMP_ROOM(double, room, &x->number), KMP_ROOM(bool, room, &x->was, &x->due, &x->taken));
    KMP_TRY(kmp_made(model->context, made));
    for (int k = 0; k < room; k++)
        if (model->states[k].next)
            x->state[x->count++] = k;
    find_conditions(run);
    KMP_TRY(make_program(x, model));
    x->machine = kmp_machine_new(x->program, run->eval->backend);
    KMP_TRY(kmp_made(model->context, x->machine));
    for (int k = 0; k < x->count; k++) {
        bool sampled = !comparison_of(run, k) && contact_of(run, k) < 0;
        x->number[k] = sampled ? kmp_first_sample(t, model->states[x->state[k]].period) : 1;
    }
    return KEMPE_OK;
}

size_t kmp_sampler_memory_size(const kempe_model *model)
{
    size_t count = 0;
    for (int k = 0; k < model->state_count; k++)
        count += model->states[k].next != NULL;
    return count * (sizeof(double) + 2 * sizeof(bool));
}

int kmp_runner_sampler_memory(kmp_runner *run, kmp_memory_piece *piece)
{
    kmp_sampler *x = run->sampler;
    size_t count = x ? (size_t)x->count : 0;
    if (!x)
        return 0;
    piece[0] = (kmp_memory_piece){x->number, count * sizeof *x->number};
    piece[1] = (kmp_memory_piece){x->was, count * sizeof *x->was};
    piece[2] = (kmp_memory_piece){x->due, count * sizeof *x->due};
    return 3;
}

void kmp_runner_free_sampler(kmp_runner *run)
{
    if (!run->sampler)
        return;
    kmp_machine_free(run->sampler->machine);
    kmp_program_free(run->sampler->program);
}

void kmp_runner_take_samples(kmp_runner *run, double t)
{
    kmp_sampler *x = run->sampler;
    double *qd = run->room.state + run->s->n;
    kmp_delays_take(run, t);
    bool due = x && kmp_runner_sample_is_due(run, t);
    for (int k = 0; x && k < x->count; k++)
        due = due || x->due[k];
    if (!due)
        return;
    kmp_machine_set(x->machine, KMP_IN_PARAMETER, run->s->parameters);
    (void)kmp_machine_run(x->machine, 0);
    kmp_machine_set(x->machine, KMP_IN_TIME, kmp_present_inputs_at(&run->eval->inputs, t));
    kmp_machine_set(x->machine, KMP_IN_CHART, run->eval->chart);
    kmp_machine_set(x->machine, KMP_IN_Q, run->room.state);
    kmp_machine_set(x->machine, KMP_IN_QD, qd);
    const double *next = kmp_machine_run(x->machine, 1);
    for (int k = 0; k < x->count; k++)
        x->taken[k] = x->due[k] || time_of(run, k) <= kmp_last_equal(t);
    if (run->spec.sample)
        run->spec.sample(run->spec.user, x->count, x->taken, x->condition);
    for (int k = 0; k < x->count; k++)
        if (x->taken[k]) {
            qd[kmp_model_coordinates(run->s->model) + x->state[k]] = next[k];
            x->number[k] += time_of(run, k) <= kmp_last_equal(t);
            x->due[k] = false;
        }
}
