/* SPDX-License-Identifier: BSD-3-Clause */
/* Inputs and sampled states of the model during a run. Each step has one polynomial for each input: it ends at the next
 * sample. Beyond it the integrator restarts where a value jumps, and continues in its order elsewhere. Each sampled
 * state takes its next value at a sample, from the state of the motion before any of them has changed. A sample is
 * taken once, when the run goes on from its time. */
#include "backend/x86/machine.h"
#include "dynamics/equations.h"
#include "integrators/run/runner.h"
#include <math.h>

/* An input of a closure must have no jump in value and rate, which no force can follow. */
static kempe_status check_closures(const kmp_runner *run, double t)
{
    const kmp_present_inputs *inputs = &run->eval->inputs;
    const kempe_model *model = run->s->model;
    for (int k = 0; k < inputs->count; k++) {
        const kmp_signal_piece *piece = &inputs->piece[k];
        bool jumps =
            piece->from == t && piece->jump < 2 && !inputs->replaced[k]; /* callers' values are checked before */
        const kmp_closure *closure = jumps ? kmp_model_moved_by(model, k) : NULL;
        if (closure)
            return kmp_fail(run->s->context, KEMPE_E_FAILED,
                            "%s:%d:%d: closure '%s' depends on input '%s', whose %s jumps at t = %.9g s: let its "
                            "samples be cubic and extend beyond the end of the run",
                            model->files[closure->place.file], closure->place.line, closure->place.column,
                            closure->name, model->inputs[k].name, piece->jump ? "rate" : "value", t);
    }
    return KEMPE_OK;
}

kempe_status kmp_runner_take_inputs(kmp_runner *run, double t)
{
    int input;
    if (run->eval->inputs.count == 0 || kmp_present_inputs_enter(&run->eval->inputs, t, &input) >= 2)
        return KEMPE_OK;
    return check_closures(run, t);
}

kempe_status kmp_runner_take_conditions(kmp_runner *run, double t)
{
    const double *q = run->state, *qd = q + run->s->n;
    bool changed;
    if (!run->crossing || (run->eval->inputs.count == 0 && !run->sampler))
        return KEMPE_OK;
    KMP_TRY(kmp_crossing_change(run->crossing, t, q, qd, false, &changed));
    run->crossing->end = kmp_crossing_first_end(run->crossing);
    return run->crossing->end >= 0 ? kmp_runner_end(run, t, run->crossing->end) : KEMPE_OK;
}

static kempe_status extend(kmp_runner *run)
{
    double limit = kmp_runner_limit(run);
    if (run->kind->extend)
        return run->kind->extend(run->solver, limit);
    run->solver->t_end = limit;
    return KEMPE_OK;
}

kempe_status kmp_runner_pass_samples(kmp_runner *run, double t)
{
    kmp_present_inputs *inputs = &run->eval->inputs;
    int input, jump;
    if (inputs->waiting || t >= kmp_present_inputs_until(inputs)) {
        jump = kmp_present_inputs_enter(inputs, t, &input);
        if (jump < 2)
            KMP_TRY(check_closures(run, t));
        run->anew = run->anew || jump == 0;
    }
    run->anew = run->anew || t >= kmp_runner_next_sample(run);
    return run->anew || run->solver->t_end == kmp_runner_limit(run) ? KEMPE_OK : extend(run);
}

void kmp_runner_stop_at(kmp_runner *run, double stop)
{
    run->stop = stop;
}

kmp_present_inputs *kmp_runner_inputs(kmp_runner *run)
{
    return &run->eval->inputs;
}

const double *kmp_runner_modes(const kmp_runner *run)
{
    return run->eval->mode;
}

double kmp_runner_rate_scale(const kmp_runner *run)
{
    return run->rate_scale;
}

kempe_status kmp_runner_pass(kmp_runner *run, double t)
{
    return run->at_event && t == run->event_t ? kmp_runner_change(run, t) : KEMPE_OK;
}

/* -- sampled states ----------------------------------------------------------------------------------- */

struct kmp_sampler {
    kmp_program *program; /* the next values of the sampled states at (t, q, qd) */
    kmp_machine *machine;
    int count;
    int *state;      /* of each: its index among the states */
    double *number;  /* of its next sample */
    int *condition;  /* whose change to true is an event of it; -1: none */
    bool *was, *due; /* the comparison was true; it has become so, and the state has not changed since */
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

/* The comparison at whose change a state changes; NULL: it is sampled. */
static const kmp_expr *comparison_of(const kmp_runner *run, int k)
{
    return kmp_state_rate(run->s->model, run->sampler->state[k])->a;
}

/* The condition of a comparison holds where its first side is less; <= and >= are then false. */
static bool is_true(const kmp_runner *run, int k)
{
    const kmp_expr *e = comparison_of(run, k);
    int condition = run->sampler->condition[k];
    bool holds = condition >= 0 && run->eval->mode[condition] > 0;
    return condition >= 0 && holds != (e->kind == KMP_EXPR_AT_MOST || e->kind == KMP_EXPR_AT_LEAST);
}

static void find_conditions(kmp_runner *run)
{
    kmp_sampler *x = run->sampler;
    const kmp_events *events = &run->s->events;
    for (int k = 0; k < x->count; k++) {
        x->condition[k] = -1;
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

/* The first sample at t or after. */
static void begin(kmp_runner *run, double t)
{
    kmp_sampler *x = run->sampler;
    for (int k = 0; k < x->count; k++) {
        if (comparison_of(run, k)) {
            x->number[k] = 1;
            continue;
        }
        x->number[k] = fmax(ceil(t / run->s->model->states[x->state[k]].period) - 1, 0);
        while (time_of(run, k) < t)
            x->number[k]++;
    }
}

static void list_states(kmp_sampler *x, const kempe_model *model)
{
    for (int k = 0; k < model->state_count; k++)
        if (model->states[k].next)
            x->state[x->count++] = k;
}

/* Conditions in the expressions have the values of the state. */
static kempe_status make_program(kmp_sampler *x, const kempe_model *model)
{
    const kmp_scene scene = {.sets = KMP_SET_CLOSURE, .plain = true, .charted = true};
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
    *x = (kmp_sampler){.state = KMP_ARENA_NEW(&run->arena, int, model->state_count),
                       .number = KMP_ARENA_NEW(&run->arena, double, model->state_count),
                       .condition = KMP_ARENA_NEW(&run->arena, int, model->state_count),
                       .was = KMP_ARENA_NEW(&run->arena, bool, model->state_count),
                       .due = KMP_ARENA_NEW(&run->arena, bool, model->state_count)};
    KMP_TRY(kmp_made(model->context, !run->arena.failed));
    list_states(x, model);
    find_conditions(run);
    KMP_TRY(make_program(x, model));
    x->machine = kmp_machine_new(x->program, run->eval->backend);
    KMP_TRY(kmp_made(model->context, x->machine));
    begin(run, t);
    return KEMPE_OK;
}

void kmp_runner_free_sampler(kmp_runner *run)
{
    if (!run->sampler)
        return;
    kmp_machine_free(run->sampler->machine);
    kmp_program_free(run->sampler->program);
}

static bool is_due(const kmp_sampler *x)
{
    bool any = false;
    for (int k = 0; k < x->count; k++)
        any = any || x->due[k];
    return any;
}

void kmp_runner_take_samples(kmp_runner *run, double t)
{
    kmp_sampler *x = run->sampler;
    double *qd = run->state + run->s->n;
    if (!x || (t < kmp_runner_next_sample(run) && !is_due(x)))
        return;
    kmp_machine_set(x->machine, KMP_IN_PARAMETER, run->s->parameters);
    (void)kmp_machine_run(x->machine, 0);
    kmp_machine_set(x->machine, KMP_IN_TIME, kmp_present_inputs_at(&run->eval->inputs, t));
    kmp_machine_set(x->machine, KMP_IN_CHART, run->eval->chart);
    kmp_machine_set(x->machine, KMP_IN_Q, run->state);
    kmp_machine_set(x->machine, KMP_IN_QD, qd);
    const double *next = kmp_machine_run(x->machine, 1);
    for (int k = 0; k < x->count; k++)
        if (x->due[k] || time_of(run, k) <= t) {
            qd[kmp_model_coordinates(run->s->model) + x->state[k]] = next[k];
            x->number[k] += !x->due[k];
            x->due[k] = false;
        }
}
