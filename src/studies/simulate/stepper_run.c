/* SPDX-License-Identifier: BSD-3-Clause */
/* The public stepper: a runner, and its current row; its inputs; its state, set, saved, restored, copied; other values
 * of parameters. A restored stepper makes its runner again only from the saved numbers, so that nothing of what
 * happened in between remains. */
#include "studies/simulate/stepper_run.h"
#include "base/memory.h"
#include "constraints/inexact/nearest_exact.h"
#include "constraints/tolerances.h"
#include "constraints/workspace/state_workspace.h"
#include "integrators/run/delays.h"
#include "integrators/run/runner_change.h"
#include "integrators/run/runner_start.h"
#include "integrators/steppers/sample_times.h"
#include "model/data/parameter.h"
#include "model/data/variant.h"
#include "model/read/loads.h"
#include "output/print.h"
#include <kempe/settings.h>
#include <math.h>
#include <string.h>

struct kmp_stepper_parameters {
    kmp_arena arena;
    const kempe_model *model; /* the user's */
    kempe_system *system;
    kmp_variant *variant;
    int count;
    const char **name;
    double *value;
};

typedef struct kmp_stepper_parameters parameters;

static void parameters_free(parameters *p)
{
    if (!p)
        return;
    kempe_system_free(p->system);
    kmp_variant_free(p->variant);
    kmp_arena_free(&p->arena);
    kmp_free(p);
}

/* -- the runner, and its current row ------------------------------------------------------------------------ */

/* The current time, where the runner has it: the end of its last step, up to rounding. */
static double time_here(const kempe_stepper *s)
{
    double end = kmp_runner_t(s->runner);
    return kmp_same_time(s->t, end) ? end : s->t;
}

/* Takes the row at t, within the last step or at its end up to rounding; after a failure the old one is unchanged. */
static kempe_status stand_at(kempe_stepper *s, double t)
{
    double *row = s->next;
    KMP_TRY(kmp_runner_row(s->runner, fmin(t, kmp_runner_t(s->runner)), row, &s->work));
    s->next = s->row;
    s->row = row;
    s->t = t;
    return KEMPE_OK;
}

/* Keeps the sentence of a failure, and gives it to the context too; forgets an earlier one. */
static kempe_status settle(kempe_stepper *s, kempe_status status)
{
    kmp_run_report report;
    if (status == KEMPE_E_ARGUMENT)
        return status;
    kmp_free(s->reason);
    s->reason = NULL;
    s->status = status;
    s->doubted = s->doubted || kmp_context_verdict(s->system->context, KEMPE_OK) != KEMPE_OK;
    if (status == KEMPE_OK)
        return status;
    kmp_runner_report(s->runner, &report);
    s->reason = report.reason;
    if (status == KEMPE_E_FAILED && s->reason && !strstr(kempe_context_message(s->system->context), s->reason))
        return kmp_fail(s->system->context, status, "%s", s->reason);
    return status;
}

/* Makes the runner of `spec` from a start (NULL: the model is assembled) in place of the present one, and is at
 * its first time. After a failure the stepper is unchanged. */
static kempe_status make_runner(kempe_stepper *s, const kmp_run_spec *spec, const kempe_assembly *start)
{
    kmp_runner *before = s->runner, *runner = NULL;
    kempe_status status = kmp_runner_new(s->system, spec, start, &runner);
    if (!runner)
        return status;
    s->runner = runner;
    if (status == KEMPE_OK)
        status = stand_at(s, spec->t_start);
    if (status != KEMPE_OK && before) {
        (void)settle(s, status);
        s->runner = before;
        kmp_runner_free(runner);
        return status;
    }
    kmp_runner_free(before);
    if (before)
        status = settle(s, status);
    s->stop = s->spec.t_end;
    s->own_stop = INFINITY;
    s->given = false;
    return status;
}

/* Assembles a stepper that has its spec. */
static kempe_status start(kempe_stepper *s, const kempe_system *system)
{
    s->system = system;
    s->bounded = s->spec.max_steps == 0;
    s->spec.max_steps = s->bounded ? -1 : s->spec.max_steps; /* t_end is far: the bound is of each advance */
    KMP_TRY(kmp_made(system->context, KMP_ARENA_EACH(&s->arena, double, 3 * system->n + system->m, &s->row, &s->next)));
    kempe_status status = make_runner(s, &s->spec, NULL);
    return s->runner ? settle(s, status) : status;
}

kempe_status kempe_stepper_new(const kempe_system *system, const kempe_run_options *run, kempe_stepper **stepper)
{
    KMP_WANTED_BOTH(system, stepper);
    KMP_OPTIONS(system->context, kempe_run_options, run);
    KMP_TRY(kmp_run_options_check(system->context, run, KMP_STUDY_STEPPER));
    kmp_model_begin_forces(system->model);
    KMP_MAKE(system->context, kempe_stepper, s);
    kempe_status status = kmp_spec_of(system, run, &s->arena, &s->spec);
    if (status == KEMPE_OK)
        status = start(s, system);
    return KMP_GIVE_OR_FREE(status, stepper, s, kempe_stepper_free);
}

kempe_status kmp_stepper_new(const kempe_system *system, const kmp_run_spec *spec, kempe_stepper **stepper)
{
    KMP_MAKE(system->context, kempe_stepper, s);
    s->spec = *spec;
    kempe_status status = start(s, system);
    return KMP_GIVE_OR_FREE(status, stepper, s, kempe_stepper_free);
}

KMP_FREES(kempe_stepper, stepper, kempe_workspace_free(stepper->closer), kmp_runner_free(stepper->runner),
          parameters_free(stepper->parameters), kmp_arena_free(&stepper->arena), kmp_free(stepper->reason))

void kempe_stepper_keep_inputs(kempe_stepper *stepper, int keep)
{
    if (stepper)
        stepper->keeps = keep;
}

/* Inputs may have changed since the last call: they apply from here on. While they may change, no step goes beyond
 * `until`. */
static kempe_status follow_inputs(kempe_stepper *s, double until)
{
    bool forced = s->system->force && !s->keeps, given = s->given, cut;
    double here = time_here(s), own_stop = kmp_last_equal(here) < s->own_stop ? s->own_stop : INFINITY;
    double stop = fmin(forced || s->samples ? until : s->spec.t_end, own_stop);
    if (!forced && !given && stop == s->stop)
        return KEMPE_OK;
    cut = forced || s->system->force || kmp_runner_t(s->runner) > (given ? here : stop);
    s->stop = stop;
    s->given = false;
    if (cut)
        return kmp_runner_cut(s->runner, here, stop);
    kmp_runner_stop_at(s->runner, stop);
    return KEMPE_OK;
}

kempe_status kmp_stepper_stand_with_inputs(kempe_stepper *s)
{
    if (!s->given)
        return KEMPE_OK;
    s->given = false;
    KMP_TRY(kmp_runner_cut(s->runner, time_here(s), s->stop));
    return stand_at(s, s->t);
}

/* Begins a call that moves the stepper. KEMPE_E_ARGUMENT from inside its own force function. */
static kempe_status enter(kempe_stepper *s)
{
    if (s->steps)
        return kmp_fail(s->system->context, KEMPE_E_ARGUMENT,
                        "the stepper is inside a step: its force function cannot move it");
    kmp_model_begin(s->system->model);
    return KEMPE_OK;
}

static kempe_status step(kempe_stepper *s)
{
    kempe_status status = KEMPE_OK;
    if (kmp_last_equal(s->t) >= s->spec.t_end)
        return kmp_fail(s->system->context, KEMPE_E_ARGUMENT, "the run ends at t_end = %g s", s->spec.t_end);
    status = follow_inputs(s, s->spec.t_end);
    if (status == KEMPE_OK && kmp_last_equal(s->t) >= kmp_runner_t(s->runner))
        status = kmp_runner_step(s->runner);
    kempe_status stood = status == KEMPE_OK || status == KEMPE_STOPPED ? stand_at(s, kmp_runner_t(s->runner)) : status;
    return settle(s, stood == KEMPE_OK ? status : stood);
}

kempe_status kempe_stepper_step(kempe_stepper *s)
{
    KMP_WANTED(NULL, s, "stepper");
    KMP_TRY(enter(s));
    s->steps = true;
    kempe_status status = step(s);
    s->steps = false;
    return status;
}

static kempe_status advance(kempe_stepper *s, double t)
{
    kempe_status status = KEMPE_OK;
    if (!(t >= s->t) || t > kmp_last_equal(s->spec.t_end))
        return kmp_fail(s->system->context, KEMPE_E_ARGUMENT,
                        "t = %.9g s is not between here (%.9g s) and t_end = %g s", t, s->t, s->spec.t_end);
    if (t > s->t)
        status = follow_inputs(s, t);
    if (s->bounded)
        kmp_runner_bound_until(s->runner, t);
    while (status == KEMPE_OK && kmp_last_equal(kmp_runner_t(s->runner)) < t)
        status = kmp_runner_step(s->runner);
    kmp_runner_bound_until(s->runner, 0);
    kempe_status stood = status == KEMPE_OK            ? stand_at(s, t)
                         : kmp_runner_ended(s->runner) ? stand_at(s, kmp_runner_t(s->runner))
                                                       : status;
    return settle(s, status == KEMPE_OK || stood != KEMPE_OK ? stood : status);
}

kempe_status kempe_stepper_advance(kempe_stepper *s, double t)
{
    KMP_WANTED(NULL, s, "stepper");
    KMP_TRY(enter(s));
    s->steps = true;
    kempe_status status = advance(s, t);
    s->steps = false;
    return status;
}

KMP_GETTER(double kempe_stepper_time(const kempe_stepper *stepper), stepper, stepper->t, NAN)

#define PART_OF_ROW(name, at)                                                                                          \
    KMP_GETTER(const double *kempe_stepper_##name(const kempe_stepper *stepper), stepper,                              \
               stepper->row + (at)*stepper->system->n, NULL)

PART_OF_ROW(q, 0)
PART_OF_ROW(qd, 1)
PART_OF_ROW(qdd, 2)
PART_OF_ROW(lambda, 3)

kempe_work kempe_stepper_work(const kempe_stepper *stepper)
{
    KMP_GIVEN(stepper, (kempe_work){0});
    kmp_run_report r;
    kmp_runner_count(stepper->runner, &r);
    return (kempe_work){.steps = r.steps,
                        .rejected = r.rejected,
                        .refused = r.refused,
                        .rhs = r.rhs,
                        .newton = r.newton,
                        .factorizations = r.factorizations,
                        .exchanges = r.exchanges,
                        .centrings = r.centrings};
}

KMP_GETTER(kempe_outcome kempe_stepper_outcome(const kempe_stepper *s), s,
           kmp_outcome_checked(s->status == KEMPE_OK && s->doubted ? KEMPE_UNTRUSTED : s->status, false),
           KEMPE_OUTCOME_NONE)
KMP_GETTER(const char *kempe_stepper_reason(const kempe_stepper *stepper), stepper,
           stepper->reason ? stepper->reason : "", "")

struct kempe_stepper_state {
    kmp_arena arena;
    const kempe_system *system;
    double t, shown_t, own_stop, work, step, rate_scale;
    bool samples, doubted, elsewhere; /* `elsewhere`: the row is not the row of the memory */
    kmp_stand_in stand_in;
    double *row, *shown;   /* q, qd where the run continues: after an event at t; as they are shown: before it */
    double *given, *mode;  /* q before closing; a value for each condition */
    unsigned char *memory; /* what is done: samples, events, modes */
    kmp_present_inputs inputs;
    kmp_past *past; /* of delayed signals, until t; NULL: there are none */
};

/* -- inputs ------------------------------------------------------------------------------------------ */

kempe_status kempe_stepper_set_input_rates(kempe_stepper *s, int input, double value, double rate, double acceleration)
{
    KMP_WANTED(NULL, s, "stepper");
    const double values[3] = {value, rate, acceleration};
    int count = kempe_model_input_count(s->system->model);
    if (input < 0 || input >= count)
        return kmp_fail(s->system->context, KEMPE_E_ARGUMENT, "there is no input %d: the model has %d", input, count);
    if (!isfinite(value) || !isfinite(rate) || !isfinite(acceleration))
        return kmp_fail(s->system->context, KEMPE_E_ARGUMENT, "input '%s' is not finite",
                        kempe_model_input_name(s->system->model, input));
    /* A closure follows an input only where value and rate are continuous. */
    const kmp_closure *closure = kmp_model_moved_by(s->system->model, input);
    double now[3];
    kmp_signal_values(&kmp_runner_inputs(s->runner)->piece[input], s->t, now);
    for (int d = 0; closure && d < 2; d++)
        if (!(fabs(values[d] - now[d]) <= KMP_INPUT_CONTINUOUS * fmax(fabs(now[d]), s->system->length)))
            return kmp_fail(s->system->context, KEMPE_E_ARGUMENT,
                            "input '%s' moves closure '%s', and its %s would jump from %.9g to %.9g: give it values "
                            "that continue (kempe_stepper_set_input_rates)",
                            kempe_model_input_name(s->system->model, input), closure->name, d ? "rate" : "value",
                            now[d], values[d]);
    kmp_present_inputs_give(kmp_runner_inputs(s->runner), input, time_here(s), values);
    s->samples = s->given = true;
    return KEMPE_OK;
}

kempe_status kempe_stepper_set_input(kempe_stepper *stepper, int input, double value)
{
    return kempe_stepper_set_input_rates(stepper, input, value, 0, 0);
}

double kempe_stepper_input(const kempe_stepper *stepper, int input)
{
    double values[3];
    if (!stepper || input < 0 || input >= kempe_model_input_count(stepper->system->model))
        return NAN;
    kmp_signal_values(&kmp_runner_inputs(stepper->runner)->piece[input], stepper->t, values);
    return values[0];
}

kempe_status kempe_stepper_set_stop(kempe_stepper *s, double t)
{
    KMP_WANTED(NULL, s, "stepper");
    kmp_context_clear(s->system->context);
    if (!(t > s->t) || kmp_same_time(t, s->t))
        return kmp_fail(s->system->context, KEMPE_E_ARGUMENT, "a stop at %.9g s is not after the present %.9g s", t,
                        s->t);
    s->own_stop = t;
    return KEMPE_OK;
}

/* -- states ------------------------------------------------------------------------------------------ */

static kempe_stepper_state *state_new(const kempe_system *system)
{
    size_t n = (size_t)system->n, modes = (size_t)system->events.count;
    kempe_stepper_state *state = KMP_NEW(kempe_stepper_state, 1);
    if (!state)
        return NULL;
    state->system = system;
    KMP_ARENA_MAKE(&state->arena, KMP_ROOM(double, 2 * n, &state->row, &state->shown),
                   KMP_ROOM(double, n, &state->given), KMP_ROOM(double, modes, &state->mode),
                   KMP_ROOM(unsigned char, kmp_runner_memory_size(system), &state->memory));
    if (kmp_present_inputs_init(&state->inputs, &state->arena, system->model) && !state->arena.failed)
        return state;
    kempe_stepper_state_free(state);
    return NULL;
}

KMP_FREES(kempe_stepper_state, state, kmp_past_free(state->past), kmp_arena_free(&state->arena))

/* Records the current row. Samples and given inputs that are still to come here are still to come from the state. */
static kempe_status record(kempe_stepper *s, kempe_stepper_state *state, bool passes)
{
    const size_t size = 2 * (size_t)s->system->n * sizeof *state->row;
    state->t = time_here(s);
    state->shown_t = s->t;
    state->own_stop = s->own_stop;
    state->work = s->work;
    memcpy(state->row, s->row, size);
    memcpy(state->shown, s->row, size);
    if (passes) {
        /* Passes an event here, so that the run from the state begins behind it. */
        bool passed;
        KMP_TRY(kmp_runner_pass(s->runner, state->t, &passed));
        if (passed) {
            KMP_TRY(kmp_runner_row(s->runner, state->t, s->next, &state->work));
            memcpy(state->row, s->next, 2 * (size_t)s->system->n * sizeof *state->row);
        }
    }
    state->step = kmp_runner_step_size(s->runner);
    state->rate_scale = kmp_runner_rate_scale(s->runner);
    state->stand_in = kmp_runner_stand_in(s->runner);
    state->samples = s->samples;
    state->doubted = s->doubted;
    memcpy(state->mode, kmp_runner_modes(s->runner), (size_t)s->system->events.count * sizeof *state->mode);
    kmp_runner_keep_memory(s->runner, state->memory);
    KMP_TRY(kmp_delays_record(s->runner, state->t));
    kmp_present_inputs_copy(&state->inputs, kmp_runner_inputs(s->runner));
    if (state->inputs.past) {
        state->past = kmp_past_copy(state->inputs.past);
        KMP_TRY(kmp_made(s->system->context, state->past));
        state->inputs.past = state->past;
    }
    return KEMPE_OK;
}

/* A state to return to, of the current time and row; `passes`: after an event here. */
static kempe_status save_state(kempe_stepper *s, bool passes, kempe_stepper_state **state)
{
    kempe_stepper_state *made = state_new(s->system);
    kempe_status status = made ? record(s, made, passes) : kmp_fail_memory(s->system->context);
    return KMP_GIVE_OR_FREE(status, state, made, kempe_stepper_state_free);
}

/* `modes`, `memory`: NULL: as at a start. */
static kempe_status run_from_memory(kempe_stepper *s, const kempe_stepper_state *state, const double *modes,
                                    const void *memory)
{
    kmp_run_spec spec = s->spec;
    const kempe_assembly start = {
        .system = s->system, .q = state->row, .qd = state->row + s->system->n, .closed = true};
    spec.t_start = state->t;
    spec.work_start = state->work;
    spec.first_step = state->step;
    spec.rate_scale = state->rate_scale;
    spec.stand_in = state->stand_in;
    spec.mode_start = modes;
    spec.inputs_start = &state->inputs;
    spec.memory_start = memory;
    spec.elsewhere = state->elsewhere;
    spec.due = true;
    KMP_TRY(make_runner(s, &spec, &start));
    memcpy(s->row, state->shown, 2 * (size_t)s->system->n * sizeof *s->row); /* closing changes it by rounding */
    s->t = state->shown_t;
    s->own_stop = state->own_stop;
    s->samples = state->samples;
    s->doubted = state->doubted || kmp_context_verdict(s->system->context, KEMPE_OK) != KEMPE_OK;
    return KEMPE_OK;
}

static kempe_status run_from(kempe_stepper *s, const kempe_stepper_state *state)
{
    return run_from_memory(s, state, s->system->events.count > 0 ? state->mode : NULL, state->memory);
}

kempe_status kempe_stepper_save(kempe_stepper *s, kempe_stepper_state **state)
{
    KMP_WANTED(NULL, s, "stepper");
    KMP_WANTED(s->system->context, state, "state");
    KMP_TRY(enter(s));
    kempe_stepper_state *made = NULL;
    KMP_TRY(save_state(s, true, &made));
    kempe_status status = run_from(s, made);
    return KMP_GIVE_OR_FREE(status, state, made, kempe_stepper_state_free);
}

kempe_status kempe_stepper_restore(kempe_stepper *s, const kempe_stepper_state *state)
{
    KMP_WANTED(NULL, s, "stepper");
    KMP_WANTED(s->system->context, state, "state");
    KMP_TRY(enter(s));
    if (state->system != s->system)
        return kmp_fail(s->system->context, KEMPE_E_ARGUMENT, "the state belongs to a stepper of another system");
    return run_from(s, state);
}

kempe_status kempe_stepper_reset(kempe_stepper *s)
{
    KMP_WANTED(NULL, s, "stepper");
    KMP_TRY(enter(s));
    const bool doubted = s->doubted;
    s->doubted = false;
    kempe_status status = make_runner(s, &s->spec, NULL);
    s->doubted = s->doubted || (status != KEMPE_OK && doubted);
    KMP_TRY(status);
    s->samples = false;
    return KEMPE_OK;
}

/* The independent coordinates that the options name are in the arena of the original. */
static kempe_status copy_spec(const kempe_stepper *s, kempe_stepper *to)
{
    int *u = KMP_ARENA_NEW(&to->arena, int, s->system->n);
    KMP_TRY(kmp_made(s->system->context,
                     KMP_ARENA_EACH(&to->arena, double, 3 * s->system->n + s->system->m, &to->row, &to->next)));
    to->system = s->system;
    to->spec = s->spec;
    to->keeps = s->keeps;
    if (s->spec.u_count > 0) {
        memcpy(u, s->spec.u, (size_t)s->spec.u_count * sizeof *u);
        to->spec.u = u;
    }
    return KEMPE_OK;
}

kempe_status kempe_stepper_copy(kempe_stepper *s, kempe_stepper **copy)
{
    KMP_WANTED(NULL, s, "stepper");
    KMP_WANTED(s->system->context, copy, "copy");
    kempe_stepper_state *state = NULL;
    KMP_TRY(kempe_stepper_save(s, &state));
    kempe_stepper *made = KMP_NEW(kempe_stepper, 1);
    kempe_status status = made ? copy_spec(s, made) : kmp_fail_memory(s->system->context);
    if (status == KEMPE_OK && state)
        status = run_from(made, state);
    kempe_stepper_state_free(state);
    return KMP_GIVE_OR_FREE(status, copy, made, kempe_stepper_free);
}

kempe_status kmp_stepper_continue(kempe_stepper *s, const kmp_stepper_start *start)
{
    const size_t n = (size_t)s->system->n;
    kempe_stepper_state *state = state_new(s->system);
    KMP_TRY(kmp_made(s->system->context, state));
    state->t = state->shown_t = start->t;
    state->own_stop = INFINITY;
    state->work = start->work;
    state->step = start->step;
    state->rate_scale = start->rate_scale;
    state->samples = true;
    if (n > 0) {
        memcpy(state->row, start->q, n * sizeof *state->row);
        memcpy(state->row + n, start->qd, n * sizeof *state->row);
        memcpy(state->shown, state->row, 2 * n * sizeof *state->row);
    }
    kmp_present_inputs_copy(&state->inputs, start->inputs);
    kempe_status status = run_from_memory(s, state, start->modes, start->memory);
    kempe_stepper_state_free(state);
    return status;
}

/* -- states as bytes ------------------------------------------------------------------------------------ */

enum { MOST_PIECES = 24 };

/* All that a run from the state reads. */
static int list_pieces(kempe_stepper_state *state, kmp_memory_piece *piece)
{
    kmp_present_inputs *inputs = &state->inputs;
    const size_t n = (size_t)state->system->n, count = (size_t)inputs->count;
    const kmp_memory_piece all[] = {
        {&state->t, sizeof state->t},
        {&state->shown_t, sizeof state->shown_t},
        {&state->own_stop, sizeof state->own_stop},
        {&state->work, sizeof state->work},
        {&state->step, sizeof state->step},
        {&state->rate_scale, sizeof state->rate_scale},
        {&state->samples, sizeof state->samples},
        {&state->doubted, sizeof state->doubted},
        {&state->stand_in.active, sizeof state->stand_in.active},
        {&state->stand_in.returns, sizeof state->stand_in.returns},
        {state->row, 2 * n * sizeof *state->row},
        {state->shown, 2 * n * sizeof *state->shown},
        {state->memory, kmp_runner_memory_size(state->system)},
        {state->mode, (size_t)state->system->events.count * sizeof *state->mode},
        {inputs->piece, count * sizeof *inputs->piece},
        {inputs->replaced, count * sizeof *inputs->replaced},
        {inputs->given, count * sizeof *inputs->given},
        {inputs->waits, count * sizeof *inputs->waits},
        {&inputs->waiting, sizeof inputs->waiting},
        {inputs->vector, (size_t)kmp_present_inputs_size(inputs) * sizeof *inputs->vector},
        {&inputs->held, sizeof inputs->held},
        {&inputs->before, sizeof inputs->before},
    };
    memcpy(piece, all, sizeof all);
    return (int)(sizeof all / sizeof *all);
}

size_t kmp_stepper_packed_size(const kempe_system *system)
{
    kempe_stepper_state *state = kmp_model_delay_count(system->model) > 0 ? NULL : state_new(system);
    kmp_memory_piece piece[MOST_PIECES];
    size_t size = 0;
    for (int k = state ? list_pieces(state, piece) : 0; k-- > 0;)
        size += piece[k].size;
    kempe_stepper_state_free(state);
    return size;
}

void kmp_stepper_pack(kempe_stepper_state *state, unsigned char *to)
{
    kmp_memory_piece piece[MOST_PIECES];
    const int count = list_pieces(state, piece);
    for (int k = 0; k < count; to += piece[k++].size)
        if (piece[k].size > 0)
            memcpy(to, piece[k].at, piece[k].size);
}

kempe_stepper_state *kmp_stepper_unpack(const kempe_system *system, const unsigned char *from)
{
    kmp_memory_piece piece[MOST_PIECES];
    kempe_stepper_state *state = state_new(system);
    const int count = state ? list_pieces(state, piece) : 0;
    for (int k = 0; k < count; from += piece[k++].size)
        if (piece[k].size > 0)
            memcpy(piece[k].at, from, piece[k].size);
    return state;
}

/* -- another state ------------------------------------------------------------------------------------- */

/* Closes q and qd in place, with the inputs from now on. */
static kempe_status close_state(kempe_stepper *s, kempe_stepper_state *state)
{
    double *q = state->row, *qd = q + s->system->n;
    int input;
    if (!s->closer)
        KMP_TRY(kmp_workspace_new(s->system, &s->closer));
    kmp_present_inputs_copy(kmp_workspace_inputs(s->closer), &state->inputs);
    (void)kmp_present_inputs_enter(kmp_workspace_inputs(s->closer), state->t, &input);
    kempe_status status = kempe_workspace_close(s->closer, state->t, q, qd, NULL);
    if (status != KEMPE_E_FAILED)
        return status;
    return kmp_fail(s->system->context, status, "the state cannot be closed: %s", kempe_workspace_message(s->closer));
}

/* Closes a recorded state and continues from it. `*moved` (NULL: not wanted): as in the interface. */
static kempe_status continue_from(kempe_stepper *s, kempe_stepper_state *state, double *moved)
{
    int n = s->system->n;
    double most = 0;
    memcpy(state->given, state->row, (size_t)n * sizeof *state->given);
    KMP_TRY(close_state(s, state));
    for (int i = 0; i < n; i++)
        most = fmax(most, fabs(state->row[i] - state->given[i]) / s->system->scale[i]);
    memcpy(state->shown, state->row, 2 * (size_t)n * sizeof *state->shown);
    state->elsewhere = true;
    KMP_TRY(run_from(s, state));
    if (moved)
        *moved = most;
    return KEMPE_OK;
}

kempe_status kempe_stepper_set_state(kempe_stepper *s, const double *q, const double *qd, double *moved)
{
    KMP_WANTED(NULL, s, "stepper");
    KMP_WANTED(s->system->context, q, "q");
    int n = s->system->n;
    KMP_TRY(enter(s));
    kempe_stepper_state *state = NULL;
    KMP_TRY(save_state(s, false, &state));
    for (int i = 0; i < n; i++) {
        state->row[i] = q[i];
        state->row[n + i] = qd ? qd[i] : 0;
    }
    kempe_status status = continue_from(s, state, moved);
    kempe_stepper_state_free(state);
    return status;
}

/* -- other values of parameters ------------------------------------------------------------------------ */

/* From the current time on: a separate system, of a variant of the model. */
static parameters *merge(const kempe_stepper *s, int count, const char *const *names, const double *values)
{
    const parameters *before = s->parameters;
    int had = before ? before->count : 0;
    parameters *p = KMP_NEW(parameters, 1);
    if (!p)
        return NULL;
    p->model = before ? before->model : s->system->model;
    p->name = KMP_ARENA_NEW(&p->arena, const char *, had + count);
    p->value = KMP_ARENA_NEW(&p->arena, double, had + count);
    /* A later value of a name replaces an earlier one. */
    for (int k = 0; !p->arena.failed && k < had + count; k++) {
        const char *name = k < had ? before->name[k] : names[k - had];
        int at = 0;
        while (at < p->count && strcmp(p->name[at], name) != 0)
            at++;
        if (at == p->count)
            p->name[p->count++] = kmp_arena_strdup(&p->arena, name);
        p->value[at] = k < had ? before->value[k] : values[k - had];
    }
    if (!p->arena.failed)
        return p;
    parameters_free(p);
    return NULL;
}

static kempe_status derive(parameters *p, const kempe_system *before)
{
    kmp_text why = {0};
    KMP_TRY(kmp_variant_new(p->model, p->count, p->name, &p->variant));
    kempe_status status = kmp_variant_set(p->variant, p->value, &why);
    if (status == KEMPE_E_INPUT)
        status = kmp_fail(before->context, status, "%s", why.s ? why.s : "");
    kmp_text_free(&why);
    if (status == KEMPE_OK)
        status = kmp_system_new(kmp_variant_model(p->variant), NULL, &p->system);
    if (status == KEMPE_OK && (p->system->m != before->m || p->system->events.count != before->events.count))
        return kmp_fail(
            before->context, KEMPE_E_FAILED,
            "these values change the number of constraint equations or of conditions (%d and %d, now %d and %d)",
            before->m, before->events.count, p->system->m, p->system->events.count);
    if (status == KEMPE_OK)
        kempe_system_set_force(p->system, before->force, before->force_user);
    return status;
}

/* Continues with the system of `p`; after a failure everything is as before. */
static kempe_status take(kempe_stepper *s, parameters *p, kempe_stepper_state *state, double *moved)
{
    const kempe_system *before = s->system;
    kempe_workspace *closer = s->closer;
    s->system = p->system;
    s->closer = NULL;
    kempe_status status = continue_from(s, state, moved);
    if (status == KEMPE_OK) {
        kempe_workspace_free(closer);
        parameters_free(s->parameters);
        s->parameters = p;
        return status;
    }
    kempe_workspace_free(s->closer);
    s->closer = closer;
    s->system = before;
    return status;
}

kempe_status kempe_stepper_set_parameters(kempe_stepper *s, int count, const char *const *names, const double *values,
                                          double *moved)
{
    KMP_WANTED(NULL, s, "stepper");
    kempe_context *context = s->system->context;
    KMP_WANTED(context, names, "names");
    KMP_WANTED(context, values, "values");
    KMP_TRY(enter(s));
    for (int k = 0; k < count; k++)
        KMP_WANTED(context, names[k], "a name");
    if (count < 1)
        return kmp_fail(context, KEMPE_E_ARGUMENT, "%d parameters: a positive number is expected", count);
    kempe_stepper_state *state = NULL;
    kempe_status status = save_state(s, true, &state);
    if (status == KEMPE_STOPPED) /* an end of the run, which the values may move */
        status = save_state(s, false, &state);
    KMP_TRY(status);
    parameters *p = merge(s, count, names, values);
    status = p ? derive(p, s->system) : kmp_fail_memory(context);
    if (status == KEMPE_OK)
        status = take(s, p, state, moved);
    if (status != KEMPE_OK)
        parameters_free(p);
    kempe_stepper_state_free(state);
    return status;
}
