/* SPDX-License-Identifier: BSD-3-Clause */
/* Recording of delayed signals and their jumps. The past is polynomials of the dense output at the delayed time; a jump
 * of a derivative returns after the delay with an order higher by one, until it is smooth enough for the integrator
 * (Bellen and Zennaro 2003). */
#include "integrators/run/delays.h"
#include "backend/machine.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "dynamics/equations.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/link_tree.h"
#include "integrators/run/runner_start.h"
#include "model/data/model.h"
#include "model/language/expression_value.h"
#include <math.h>
#include <string.h>

enum { NODES = KMP_PAST_DEGREE + 1 };

/* The stages of the program: the signals before the start with the delays, and the signals at a state, which may
 * contain parts of the first ones. */
enum { BEFORE = 1, SIGNALS = 2 };

struct kmp_delays {
    kmp_program *program;
    kmp_machine *machine;
    int count;
    int *state;     /* of each: its index among the states */
    bool *direct;   /* count x count: signal i contains the state of delay j, so that jumps have the same order */
    double *values; /* room to record */
    double *row;    /* q, qd */
    kmp_past *past;
};

static const kmp_state *state_of(const kmp_runner *run, int k)
{
    return &run->s->model->states[run->delays->state[k]];
}

static double *value_of(kmp_runner *run, int k)
{
    return run->room.state + run->s->n + kmp_model_coordinates(run->s->model) + run->delays->state[k];
}

/* -- programs ---------------------------------------------------------------------------------------- */

/* Conditions in the signals are conditions of the run, so that a signal is smooth in each step. */
static kempe_status make_program(kmp_delays *x, const kempe_system *s)
{
    const kempe_model *model = s->model;
    kmp_events events = s->events; /* the system has recorded all conditions: none is added */
    const kmp_derivation_request scene = {.sets = KMP_SET_CLOSURE, .plain = true, .charted = true, .events = &events};
    kmp_equations eq;
    KMP_TRY(kmp_equations_derive_once(&eq, model, &scene));
    kmp_tree now = eq.tree, early = eq.tree;
    now.conditions.settled = true;
    early.conditions.events = NULL;
    int count[] = {2 * x->count, x->count};
    kmp_ref *signal = KMP_GRAPH_NEW(eq.graph, kmp_ref, x->count);
    kmp_ref *before = KMP_GRAPH_NEW(eq.graph, kmp_ref, 2 * x->count);
    for (int k = 0; signal && before && k < x->count; k++) {
        const kmp_state *state = &model->states[x->state[k]];
        signal[k] = kmp_tree_expression(&now, state->delayed);
        before[k] = state->before ? kmp_tree_expression(&early, state->before) : KMP_ZERO;
        before[x->count + k] = kmp_tree_number(&early, &state->delay);
    }
    const kmp_ref *const groups[] = {before, signal};
    if (signal && before && !kmp_graph_failed(eq.graph))
        x->program = kmp_program_new(eq.graph, 2, count, groups);
    kmp_equations_free(&eq);
    return kmp_made(model->context, x->program);
}

static const double *signals_at(kmp_runner *run, double t, const double *q, const double *qd)
{
    kmp_machine *machine = run->delays->machine;
    kmp_machine_set(machine, KMP_IN_TIME, kmp_present_inputs_at(&run->eval->inputs, t));
    kmp_machine_set(machine, KMP_IN_CHART, run->eval->chart);
    kmp_machine_set(machine, KMP_IN_Q, q);
    kmp_machine_set(machine, KMP_IN_QD, qd);
    if (run->eval->conditions.mode)
        kmp_machine_set(machine, KMP_IN_MODE, run->eval->conditions.mode);
    (void)kmp_machine_run(machine, BEFORE);
    return kmp_machine_run(machine, SIGNALS);
}

static const double *before_at(kmp_runner *run, double t)
{
    kmp_machine_set(run->delays->machine, KMP_IN_TIME, kmp_present_inputs_at(&run->eval->inputs, t));
    return kmp_machine_run(run->delays->machine, BEFORE);
}

static bool has_state(const kmp_expr *expr, const void *motion)
{
    return expr->kind == KMP_EXPR_UNKNOWN || (expr->kind == KMP_EXPR_QD && expr->index == *(const int *)motion);
}

static kempe_status make_delays(kmp_runner *run)
{
    const kempe_model *model = run->s->model;
    const int room = model->delay_count;
    kmp_delays *x = run->delays = KMP_ARENA_NEW(&run->arena, kmp_delays, 1);
    KMP_TRY(kmp_made(model->context, x));
    bool made =
        KMP_ARENA_MAKE(&run->arena, KMP_ROOM(int, room, &x->state), KMP_ROOM(bool, room *room, &x->direct),
                       KMP_ROOM(double, kmp_past_room(room), &x->values), KMP_ROOM(double, 2 * run->s->n, &x->row));
    KMP_TRY(kmp_made(model->context, made));
    for (int k = 0; k < model->state_count; k++)
        if (model->states[k].delayed)
            x->state[x->count++] = k;
    for (int i = 0; i < x->count * x->count; i++) {
        int motion = kmp_model_coordinates(model) + x->state[i % x->count];
        x->direct[i] = kmp_expr_find(model->states[x->state[i / x->count]].delayed, has_state, &motion);
    }
    KMP_TRY(make_program(x, run->s));
    x->machine = kmp_machine_new(x->program, run->eval->backend);
    KMP_TRY(kmp_made(model->context, x->machine));
    kmp_machine_set(x->machine, KMP_IN_PARAMETER, run->s->parameters);
    (void)kmp_machine_run(x->machine, 0);
    return KEMPE_OK;
}

void kmp_delays_free(kmp_runner *run)
{
    if (!run->delays)
        return;
    kmp_past_free(run->delays->past);
    kmp_machine_free(run->delays->machine);
    kmp_program_free(run->delays->program);
}

/* -- recording --------------------------------------------------------------------------------------- */

/* The signals at a time before the start. */
static kempe_status sample_before(void *user, double t, const double **values)
{
    kmp_runner *run = user;
    *values = before_at(run, t);
    return KEMPE_OK;
}

/* The signals at a time within the last step. */
static kempe_status sample(void *user, double t, const double **values)
{
    kmp_runner *run = user;
    kmp_delays *x = run->delays;
    double *q = x->row, *qd = q + run->s->n, work;
    KMP_TRY(kmp_runner_dense(run, t));
    if (run->formulation->row(run->formulation, t, run->room.y, q, qd, NULL, NULL, &work) != KMP_GO)
        return KEMPE_E_FAILED;
    *values = signals_at(run, t, q, qd);
    return KEMPE_OK;
}

static double tolerance(void *user, int k, double size)
{
    const kmp_runner *run = user;
    return KMP_PAST_PART * (run->spec.rtol * size + run->spec.atol * state_of(run, k)->scale) +
           KMP_PAST_ROUNDING * size;
}

/* Adds polynomials over [from, to] to the signals from number `first` to `last`. */
static kempe_status add_pieces(kmp_runner *run, double from, double to, bool early, int first, int last)
{
    kmp_delays *x = run->delays;
    const kmp_past_source source = {x->past, first, last, x->values, run, early ? sample_before : sample, tolerance};
    int fast;
    kempe_status status = kmp_past_record(&source, from, to, &fast);
    if (status == KEMPE_STOPPED)
        return kmp_fail(run->s->context, KEMPE_E_FAILED,
                        "the signal of the delay '%s' changes too fast to be recorded between t = %.9g and %.9g s",
                        state_of(run, fast)->name, from, to);
    return status == KEMPE_E_MEMORY ? kmp_fail_memory(run->s->context) : status;
}

/* Forgets what neither a later step nor a checkpoint needs. */
static void forget_past(kmp_runner *run)
{
    kmp_past *past = run->delays->past;
    const double since = run->spec.kept_past ? fmin(run->spec.kept_past->since, past->known) : past->known;
    for (int k = 0; !run->spec.recording && k < past->count; k++) {
        const kmp_signal_piece *piece = &run->eval->inputs.piece[state_of(run, k)->signal];
        kmp_past_signal *signal = &past->signal[k];
        double first = piece->c[0];
        while (first < piece->c[1] && kmp_past_piece_of(signal, first)->to < since - signal->delay)
            first++;
        if (2 * (first - signal->dropped) < signal->count)
            continue;
        run->eval->inputs.piece[state_of(run, k)->signal].c[0] = first;
        kmp_past_drop(signal, first);
    }
}

kempe_status kmp_delays_record(kmp_runner *run, double t)
{
    kmp_delays *x = run->delays;
    if (!x || !(t > x->past->known))
        return KEMPE_OK;
    if (x->past->known < kmp_runner_t_old(run) && !kmp_same_time(x->past->known, kmp_runner_t_old(run)))
        return kmp_fail(run->s->context, KEMPE_E_FAILED, "the past of delayed signals has a gap at t = %.9g s",
                        x->past->known);
    KMP_TRY(add_pieces(run, x->past->known, t, false, 0, x->count - 1));
    x->past->known = t;
    forget_past(run);
    kmp_present_inputs_renew(&run->eval->inputs);
    return KEMPE_OK;
}

/* -- jumps ------------------------------------------------------------------------------------------- */

static void jump(kmp_past_signal *signal, int order)
{
    signal->jump = order < signal->jump ? order : signal->jump;
}

void kmp_delays_jump(kmp_runner *run, int order)
{
    for (int k = 0; run->delays && k < run->delays->count; k++)
        jump(&run->delays->past->signal[k], order);
}

void kmp_delays_follow(kmp_runner *run, double t)
{
    kmp_delays *x = run->delays;
    const kmp_present_inputs *inputs = &run->eval->inputs;
    for (int k = 0; x && k < kmp_model_given_inputs(run->s->model); k++)
        if (kmp_same_time(inputs->piece[k].from, t))
            kmp_delays_jump(run, inputs->piece[k].jump);
    for (int j = 0; x && j < x->count; j++) {
        int order = kmp_present_inputs_past_jump(inputs, state_of(run, j)->signal, t);
        for (int i = 0; i < x->count; i++)
            jump(&x->past->signal[i], order + !x->direct[i * x->count + j]);
    }
}

void kmp_delays_take(kmp_runner *run, double t)
{
    const kmp_present_inputs *inputs = &run->eval->inputs;
    double u[4];
    for (int k = 0; run->delays && k < run->delays->count; k++)
        if (kmp_present_inputs_past_jump(inputs, state_of(run, k)->signal, t) < KMP_PAST_SMOOTH) {
            kmp_present_inputs_delayed(inputs, state_of(run, k)->signal, t, u);
            *value_of(run, k) = u[0];
        }
}

/* -- the start --------------------------------------------------------------------------------------- */

/* True if the signal before the start is the start value of its state: by the model, or as a parameter of an ensemble.
 */
static bool begins_given(const kmp_runner *run, int k)
{
    const kempe_model *model = run->s->model;
    const kmp_number *start = &model->start.qd[kmp_model_coordinates(model) + run->delays->state[k]];
    return state_of(run, k)->began || start->expr != state_of(run, k)->start.expr;
}

/* Sets the states of the delays at the start. A signal that begins with its own value may contain other delays. */
static kempe_status set_states(kmp_runner *run, double t)
{
    kmp_delays *x = run->delays;
    double *q = run->room.state, *qd = q + run->s->n;
    bool changed = true;
    for (int pass = 0; changed && pass <= x->count; pass++) {
        changed = false;
        const double *now = signals_at(run, t, q, qd);
        for (int k = 0; k < x->count; k++) {
            const kmp_state *state = state_of(run, k);
            double value = begins_given(run, k) ? *value_of(run, k) : now[k];
            if (state->before)
                value = before_at(run, t - x->past->signal[k].delay)[k];
            changed = changed || value != *value_of(run, k);
            *value_of(run, k) = value;
        }
    }
    return changed ? kmp_fail(run->s->context, KEMPE_E_INPUT,
                              "delayed signals depend on each other without a value at the start: give one of them "
                              "'start' or 'before'")
                   : KEMPE_OK;
}

/* Records a signal before the start, in parts between the intervals in which functions of time change. */
static kempe_status add_before(kmp_runner *run, double t, int k)
{
    const double delay = run->delays->past->signal[k].delay;
    double from = t - delay;
    for (int i = 0; i < run->scales.count; i++) {
        const double end = run->scales.end[i] - delay;
        if (!(end > from) || !(end < t))
            continue;
        KMP_TRY(add_pieces(run, from, end, true, k, k));
        from = end;
    }
    return add_pieces(run, from, t, true, k, k);
}

/* The past before the start: as long as the delay. */
static kempe_status begin_past(kmp_runner *run, double t)
{
    kmp_delays *x = run->delays;
    double constant[NODES];
    for (int k = 0; k < x->count; k++) {
        kmp_past_signal *signal = &x->past->signal[k];
        signal->jump = KMP_PAST_SMOOTH;
        if (state_of(run, k)->before) {
            KMP_TRY(add_before(run, t, k));
            continue;
        }
        for (int i = 0; i < NODES; i++)
            constant[i] = *value_of(run, k);
        KMP_TRY(kmp_made(run->s->context, kmp_past_add(signal, t - signal->delay, t, constant)));
    }
    const double *now = signals_at(run, t, run->room.state, run->room.state + run->s->n);
    for (int k = 0; k < x->count; k++) {
        double value = state_of(run, k)->before ? NAN : *value_of(run, k);
        jump(&x->past->signal[k], value == now[k]);
    }
    x->past->known = t;
    kmp_present_inputs_recall(&run->eval->inputs, x->past);
    return KEMPE_OK;
}

/* A run that continues has the past until then. Without separate inputs, its delays enter their parts here. */
static kempe_status continue_past(kmp_runner *run, double t, const kmp_past *past)
{
    kmp_delays *x = run->delays;
    kmp_present_inputs *inputs = &run->eval->inputs;
    int input;
    x->past = kmp_past_copy(past);
    KMP_TRY(kmp_made(run->s->context, x->past));
    if (x->past->known > t)
        kmp_past_cut(x->past, t);
    if (inputs->past)
        inputs->past = x->past;
    else
        kmp_present_inputs_recall(inputs, x->past);
    while (!run->spec.due && kmp_present_inputs_are_due(inputs, t))
        (void)kmp_present_inputs_enter(inputs, t, &input);
    if (!run->spec.due)
        kmp_delays_take(run, t);
    const double *delay = before_at(run, run->spec.t_start) + x->count;
    for (int k = 0; k < x->count; k++)
        if (delay[k] != x->past->signal[k].delay)
            return kmp_fail(run->s->context, KEMPE_E_ARGUMENT,
                            "the delay of '%s' cannot change during a run: begin a new one", state_of(run, k)->name);
    kmp_delays_jump(run, 0);
    return KEMPE_OK;
}

static kempe_status check_delays(kmp_runner *run)
{
    kmp_delays *x = run->delays;
    const double *delay = before_at(run, run->spec.t_start) + x->count;
    for (int k = 0; k < x->count; k++) {
        if (!(delay[k] > 0) || isinf(delay[k]))
            return kmp_fail(run->s->context, KEMPE_E_INPUT, "the delay of '%s' is %.9g s: a positive time is expected",
                            state_of(run, k)->name, delay[k]);
        if (state_of(run, k)->before && begins_given(run, k))
            return kmp_fail(run->s->context, KEMPE_E_INPUT,
                            "a start value of '%s' cannot be given: the model has its 'before'",
                            state_of(run, k)->name);
        x->past->signal[k].delay = delay[k];
    }
    return KEMPE_OK;
}

kempe_status kmp_delays_begin(kmp_runner *run, double t)
{
    if (run->s->model->delay_count == 0)
        return KEMPE_OK;
    const kmp_past *past = run->spec.past_start ? run->spec.past_start : run->eval->inputs.past;
    KMP_TRY(make_delays(run));
    run->spec.past_start = NULL; /* the caller's, until here */
    if (past) {
        KMP_TRY(continue_past(run, t, past));
    } else {
        run->delays->past = kmp_past_new(run->delays->count);
        KMP_TRY(kmp_made(run->s->context, run->delays->past));
        KMP_TRY(check_delays(run));
        KMP_TRY(set_states(run, t));
        KMP_TRY(begin_past(run, t));
    }
    if (run->spec.kept_past)
        run->spec.kept_past->past = run->delays->past;
    return KEMPE_OK;
}
