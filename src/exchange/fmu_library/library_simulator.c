/* SPDX-License-Identifier: BSD-3-Clause */
/* The interface of generated simulators (kempe_simulator.h) by a stepper of the library: all formulations and
 * integrators, friction that sticks, contacts, samples, delays. It has no states for an integrator of the caller. */
#include "base/context.h"
#include "base/memory.h"
#include "exchange/fmu_library/library_unit.h"
#include "integrators/run/run.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include "studies/simulate/stepper_run.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

/* A run needs an end: that of an importer without one. */
static const double without_end = 1e6;

static kempe_simulator_status fail(kempe_simulator *s, const char *sentence)
{
    (void)snprintf(s->message, sizeof s->message, "%s", sentence);
    return KEMPE_SIMULATOR_FAILED;
}

static kempe_simulator_status tell(kempe_simulator *s)
{
    return fail(s, kempe_context_message(kmp_library_unit_of(s)->context));
}

/* -- memory -------------------------------------------------------------------------------------------- */

static int place(kempe_simulator *s, const kempe_equations *e, double *memory)
{
    struct {
        double **array;
        int count;
    } arrays[] = {{&s->p, e->parameters},    {&s->u, 3 * e->inputs}, {&s->q, e->coordinates}, {&s->qd, e->coordinates},
                  {&s->qdd, e->coordinates}, {&s->lambda, e->rows},  {&s->y, e->outputs}};
    int used = 0;
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++) {
        *arrays[k].array = memory + used;
        used += arrays[k].count;
    }
    return used;
}

static int row_size(const kempe_equations *e)
{
    return 3 * e->coordinates + e->rows + e->outputs;
}

/* A saved state: 1 where the motion has started, the settings of its start, its parameters, time, row, inputs as given,
 * counts, then the state of the stepper. */
typedef struct saved_head {
    double started, t;
    kempe_simulator_settings settings;
    kempe_simulator_work work;
} saved_head;

enum { HEAD = (sizeof(saved_head) + sizeof(double) - 1) / sizeof(double) };

static int own_numbers(const kempe_equations *e)
{
    return e->parameters + 3 * e->inputs + row_size(e);
}

int kempe_simulator_memory(const kempe_equations *e)
{
    const kempe_simulator none = {.equations = e};
    const size_t packed = kmp_stepper_packed_size(kmp_library_unit_of(&none)->system);
    return 2 * own_numbers(e) + HEAD + (int)((packed + sizeof(double) - 1) / sizeof(double));
}

void kempe_simulator_init(kempe_simulator *s, const kempe_equations *e, double *memory)
{
    *s = (kempe_simulator){.equations = e,
                           .memory = memory,
                           .settings = {.rtol = 1e-8, .atol = 1e-8, .end = INFINITY},
                           .numbers = kempe_simulator_memory(e)};
    kmp_library_unit *unit = kmp_library_unit_of(s);
    (void)place(s, e, memory);
    kmp_library_unit_stop(unit);
    unit->before = (kempe_simulator_work){0};
    for (int k = 0; k < e->parameters; k++)
        s->p[k] = e->parameter_values[k];
    for (int k = 0; k < 3 * e->inputs; k++)
        s->u[k] = unit->given[k] = e->input_values[k];
}

/* -- the motion ---------------------------------------------------------------------------------------- */

/* The state of the stepper as that of the simulator. */
static kempe_simulator_status show(kempe_simulator *s, kempe_status status)
{
    const kempe_equations *e = s->equations;
    const kempe_stepper *stepper = kmp_library_unit_of(s)->stepper;
    const size_t n = (size_t)e->coordinates * sizeof(double);
    if (status != KEMPE_OK && status != KEMPE_STOPPED)
        return tell(s);
    s->t = stepper->t;
    memcpy(s->q, kempe_stepper_q(stepper), n);
    memcpy(s->qd, kempe_stepper_qd(stepper), n);
    memcpy(s->qdd, kempe_stepper_qdd(stepper), n);
    if (e->rows)
        memcpy(s->lambda, kempe_stepper_lambda(stepper), (size_t)e->rows * sizeof(double));
    const kmp_library_unit *unit = kmp_library_unit_of(s);
    const kempe_simulator_work *before = &unit->before;
    kmp_run_report r;
    kmp_runner_count(unit->stepper->runner, &r);
    s->work = (kempe_simulator_work){.steps = before->steps + (double)r.steps,
                                     .rejected = before->rejected + (double)r.rejected,
                                     .evaluations = before->evaluations + (double)r.rhs,
                                     .exchanges = before->exchanges + (double)r.exchanges,
                                     .events = before->events + (double)r.events};
    if (unit->outputs && kempe_outputs_at_stepper(unit->outputs, unit->stepper, s->y) != KEMPE_OK)
        return tell(s);
    (void)snprintf(s->message, sizeof s->message, "%s", kempe_stepper_reason(stepper));
    return status == KEMPE_OK ? KEMPE_SIMULATOR_GOES : KEMPE_SIMULATOR_ENDED;
}

static kempe_status set_inputs(kempe_simulator *s)
{
    kmp_library_unit *unit = kmp_library_unit_of(s);
    for (int k = 0; k < s->equations->inputs; k++) {
        const double *u = s->u + 3 * k;
        double *given = unit->given + 3 * k;
        if (memcmp(u, given, 3 * sizeof *u) == 0)
            continue;
        KMP_TRY(kempe_stepper_set_input_rates(unit->stepper, k, u[0], u[1], u[2]));
        memcpy(given, u, 3 * sizeof *u);
    }
    return KEMPE_OK;
}

/* The stepper on the mechanism with the present parameters, at the start of the model. */
static kempe_status begin(kempe_simulator *s)
{
    kmp_library_unit *unit = kmp_library_unit_of(s);
    const double end = isfinite(s->settings.end) && s->settings.end > 0 ? s->settings.end : without_end;
    const kempe_run_options run = {.size = sizeof run,
                                   .rtol = s->settings.rtol,
                                   .atol = s->settings.atol,
                                   .fixed_step = s->settings.fixed_step,
                                   .max_step = s->settings.longest > 0 ? s->settings.longest : end,
                                   .t_end = end};
    kmp_library_unit_stop(unit);
    memcpy(unit->given, s->equations->input_values, 3 * (size_t)s->equations->inputs * sizeof(double));
    KMP_TRY(kmp_library_unit_set_up(unit, s->p));
    if (kmp_stepper_packed_size(unit->set_up) != kmp_stepper_packed_size(unit->system))
        return kmp_fail(unit->context, KEMPE_E_FAILED,
                        "these values of parameters change the number of conditions of the model: export it with them");
    const kempe_system *system = unit->set_up;
    const kempe_model *model = unit->model;
    kmp_text words = {0};
    for (int o = 0; o < model->output_count; o++)
        if (kmp_output_width(model, &model->outputs[o]) > 0) {
            kmp_text_put(&words, words.length > 0 ? ", " : "");
            kmp_output_print(&words, model, &model->outputs[o]);
        }
    kempe_status status = kmp_made(unit->context, !words.failed);
    if (status == KEMPE_OK && words.length > 0)
        status = kempe_outputs_new(system, words.s, &unit->outputs);
    kmp_text_free(&words);
    KMP_TRY(status);
    return kempe_stepper_new(unit->set_up, &run, &unit->stepper);
}

kempe_simulator_status kempe_simulator_start_from(kempe_simulator *s, double t, const double *q, const double *qd)
{
    kmp_library_unit *unit = kmp_library_unit_of(s);
    if (t != 0)
        return fail(s, "A unit on the library starts at t = 0 s alone: choose this start time.");
    kempe_status status = begin(s);
    if (status == KEMPE_OK)
        status = set_inputs(s);
    if (status == KEMPE_OK && q)
        status = kempe_stepper_set_state(unit->stepper, q, qd, NULL);
    return show(s, status);
}

kempe_simulator_status kempe_simulator_start(kempe_simulator *s, double t)
{
    return kempe_simulator_start_from(s, t, NULL, NULL);
}

/* All parameters are fixed: the start takes them. */
kempe_simulator_status kempe_simulator_set_parameters(kempe_simulator *s)
{
    s->message[0] = '\0';
    return KEMPE_SIMULATOR_GOES;
}

kempe_simulator_status kempe_simulator_set_inputs(kempe_simulator *s)
{
    if (!kmp_library_unit_of(s)->stepper)
        return KEMPE_SIMULATOR_GOES;
    kempe_status status = set_inputs(s);
    return show(s, status == KEMPE_OK ? kmp_stepper_stand_with_inputs(kmp_library_unit_of(s)->stepper) : status);
}

kempe_simulator_status kempe_simulator_advance(kempe_simulator *s, double t)
{
    return show(s, kempe_stepper_advance(kmp_library_unit_of(s)->stepper, t));
}

kempe_simulator_status kempe_simulator_step(kempe_simulator *s)
{
    return show(s, kempe_stepper_step(kmp_library_unit_of(s)->stepper));
}

/* -- saved states -------------------------------------------------------------------------------------- */

int kempe_simulator_saved_numbers(const kempe_simulator *s)
{
    return s->numbers - own_numbers(s->equations);
}

/* The row of a simulator, which begins with q, and its parameters and inputs as the stepper has them. */
static void list_arrays(kempe_simulator *s, kmp_memory_piece piece[3])
{
    kmp_library_unit *unit = kmp_library_unit_of(s);
    piece[0] = (kmp_memory_piece){unit->values, (size_t)s->equations->parameters};
    piece[1] = (kmp_memory_piece){unit->given, 3 * (size_t)s->equations->inputs};
    piece[2] = (kmp_memory_piece){s->q, (size_t)row_size(s->equations)};
}

void kempe_simulator_save(const kempe_simulator *s, double *to)
{
    kmp_library_unit *unit = kmp_library_unit_of(s);
    kempe_simulator copy = *s;
    kempe_stepper_state *state = NULL;
    kmp_memory_piece piece[3];
    memset(to, 0, (size_t)kempe_simulator_saved_numbers(s) * sizeof *to);
    if (!unit->stepper || unit->source.model->delay_count > 0 || kempe_stepper_save(unit->stepper, &state) != KEMPE_OK)
        return;
    unit->before = s->work;
    const saved_head head = {.started = 1, .t = s->t, .settings = s->settings, .work = s->work};
    memcpy(to, &head, sizeof head);
    to += HEAD;
    list_arrays(&copy, piece);
    for (int k = 0; k < 3; to += piece[k++].size)
        if (piece[k].size > 0)
            memcpy(to, piece[k].at, piece[k].size * sizeof *to);
    kmp_stepper_pack(state, (unsigned char *)to);
    kempe_stepper_state_free(state);
}

static kempe_status continue_from(kempe_simulator *s, const unsigned char *packed)
{
    kmp_library_unit *unit = kmp_library_unit_of(s);
    if (!unit->stepper)
        KMP_TRY(begin(s));
    kempe_stepper_state *state = kmp_stepper_unpack(unit->set_up, packed);
    kempe_status status = kmp_made(unit->context, state);
    if (status == KEMPE_OK)
        status = kempe_stepper_restore(unit->stepper, state);
    kempe_stepper_state_free(state);
    return status;
}

void kempe_simulator_restore(kempe_simulator *s, const double *from)
{
    kmp_library_unit *unit = kmp_library_unit_of(s);
    const size_t parameters = (size_t)s->equations->parameters * sizeof(double);
    const bool other = parameters > 0 && memcmp(from + HEAD, unit->values, parameters) != 0;
    kmp_memory_piece piece[3];
    saved_head head;
    memcpy(&head, from, sizeof head);
    if (head.started == 0 || other || memcmp(&head.settings, &s->settings, sizeof head.settings) != 0)
        kmp_library_unit_stop(unit);
    if (head.started == 0)
        return;
    s->settings = head.settings;
    if (parameters)
        memcpy(s->p, from + HEAD, parameters);
    const double *packed = from + HEAD + own_numbers(s->equations);
    if (continue_from(s, (const unsigned char *)packed) != KEMPE_OK) {
        (void)tell(s);
        kmp_library_unit_stop(unit);
        return;
    }
    s->t = head.t;
    unit->before = s->work = head.work;
    list_arrays(s, piece);
    from += HEAD;
    for (int k = 0; k < 3; from += piece[k++].size)
        if (piece[k].size > 0)
            memcpy(piece[k].at, from, piece[k].size * sizeof *from);
}

/* -- for an integrator of the caller --------------------------------------------------------------------- */

static kempe_simulator_status lacking(kempe_simulator *s)
{
    return fail(s, "A unit on the library is of co-simulation: it has no states and no derivatives for the importer.");
}

/* Arrays that have no numbers. */
#define EMPTY(name, type)                                                                                              \
    void name(const kempe_simulator *s, type *array)                                                                   \
    {                                                                                                                  \
        (void)s, (void)array;                                                                                          \
    }
EMPTY(kempe_simulator_get_states, double)
EMPTY(kempe_simulator_get_rates, double)
EMPTY(kempe_simulator_get_changes, double)
EMPTY(kempe_simulator_get_choice, int)

kempe_simulator_status kempe_simulator_set_states(kempe_simulator *s, double t, const double *x)
{
    (void)t, (void)x;
    return lacking(s);
}

int kempe_simulator_wants_exchange(const kempe_simulator *s)
{
    (void)s;
    return 0;
}

kempe_simulator_status kempe_simulator_update(kempe_simulator *s, int *changed)
{
    *changed = 0;
    return lacking(s);
}

double kempe_simulator_next_time(const kempe_simulator *s)
{
    (void)s;
    return INFINITY;
}

kempe_simulator_status kempe_simulator_along(kempe_simulator *s, const kempe_simulator_change *change)
{
    (void)change;
    return lacking(s);
}
