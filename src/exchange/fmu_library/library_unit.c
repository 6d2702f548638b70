/* SPDX-License-Identifier: BSD-3-Clause */
/* A functional mock-up unit on the library: the mechanism is read from the resources of the unit, and a stepper of the
 * library takes the place of the generated simulator, by its interface (kempe_simulator.h): all formulations and
 * integrators, friction that sticks, contacts, samples, delays. It has no states for an integrator of the caller. The
 * layers of the FMI are the layers of units of sources. */
#include "base/context.h"
#include "base/file.h"
#include "base/memory.h"
#include "exchange/fmu/unit_files.h"
#include "exchange/simulator/kempe_fmu.h"
#include "integrators/run/run.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include "platform/platform.h"
#include "studies/simulate/stepper_run.h"
#include <kempe/output_handles.h>
#include <kempe/settings.h>
#include <kempe/stepper.h>
#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The mechanism of one instance, and its motion. */
typedef struct library_unit {
    kempe_fmu_model table;
    kempe_equations equations; /* only names and sizes: no function of it is called */
    kmp_code_source source;
    kmp_arena arena;
    char token[KMP_UNIT_TOKEN];
    kempe_context *context;
    const char *path;        /* of the model */
    kempe_setting *settings; /* of the export, with room for all parameters after them */
    int setting_count;
    kempe_model *model;            /* as exported */
    kempe_model *other;            /* with the values of the importer; NULL: the values of the export */
    kempe_system *system, *set_up; /* of each; set_up NULL: none */
    double *values;                /* parameters of `other` */
    kempe_outputs *outputs;        /* of the system of the motion */
    kempe_stepper *stepper;        /* the motion; NULL: it has not started */
    double *given;                 /* three an input: as the stepper has them */
    kempe_simulator_work before;   /* work until the stepper was restored */
    size_t reported;               /* length of the doubts of the motion that the importer has received */
} library_unit;

/* The unit whose equations a simulator has. */
static library_unit *unit_of(const kempe_simulator *s)
{
    return (library_unit *)(void *)((char *)(uintptr_t)s->equations - offsetof(library_unit, equations));
}

/* -- resources ----------------------------------------------------------------------------------------- */

/* A path of the URI or path of the importer, without an ending slash. */
static char *folder_of(kmp_arena *arena, const char *resources)
{
    static const char scheme[] = "file:";
    kmp_text text = {0};
    const bool uri = strncmp(resources, scheme, sizeof scheme - 1) == 0;
    if (uri) {
        resources += sizeof scheme - 1;
        resources += strncmp(resources, "///", 3) == 0 ? 2 : strncmp(resources, "//localhost/", 12) == 0 ? 11 : 0;
        if (kmp_path_is_whole(resources + 1) && !kmp_is_separator(resources[1])) /* a drive: file:///C:/folder */
            resources++;
    }
    for (; *resources; resources++) {
        char digits[3] = {0};
        unsigned code = 0;
        if (uri && *resources == '%' && resources[1] && resources[2]) {
            memcpy(digits, resources + 1, 2);
            code = (unsigned)strtoul(digits, NULL, 16);
            resources += 2;
        }
        kmp_text_append(&text, code ? (const char[]){(char)code} : resources, 1);
    }
    while (text.length > 1 && kmp_is_separator(text.s[text.length - 1]))
        text.s[--text.length] = '\0';
    return kmp_text_keep(&text, arena);
}

/* The lines of the list: the path of the model in the resources, then NAME=VALUE for each parameter that was set. */
static kempe_status read_list(library_unit *unit, const char *folder, char *text)
{
    char *line = text;
    for (char *next = NULL; line && *line; line = next) {
        next = strchr(line, '\n');
        if (next)
            *next++ = '\0';
        char *equals = strchr(line, '=');
        if (!unit->path) {
            unit->path = kmp_arena_printf(&unit->arena, "%s/%s", folder, line);
        } else if (equals) {
            *equals = '\0';
            kempe_setting *list = kmp_arena_room(&unit->arena, unit->settings, unit->setting_count, sizeof *list);
            if (!list)
                break;
            unit->settings = list;
            list[unit->setting_count++] =
                (kempe_setting){kmp_arena_strdup(&unit->arena, line), kmp_arena_strdup(&unit->arena, equals + 1)};
        }
    }
    KMP_TRY(kmp_made(unit->context, !unit->arena.failed));
    return unit->path
               ? KEMPE_OK
               : kmp_fail(unit->context, KEMPE_E_INPUT, "the list of the unit's resources is empty: export it again");
}

/* -- the table ----------------------------------------------------------------------------------------- */

static void fill_table(library_unit *unit)
{
    const kmp_code_source *s = &unit->source;
    const struct kmp_simulated *x = s->simulated;
    unit->equations = (kempe_equations){.name = s->title,
                                        .hash = s->hash,
                                        .coordinates = s->n,
                                        .rows = s->m,
                                        .inputs = s->input_count,
                                        .parameters = s->parameter_count,
                                        .outputs = s->output_count,
                                        .coordinate_names = (const char *const *)s->coordinate_names,
                                        .row_names = (const char *const *)s->row_names,
                                        .input_names = (const char *const *)s->input_names,
                                        .parameter_names = (const char *const *)s->parameter_name,
                                        .output_names = (const char *const *)s->output_names,
                                        .coordinate_kind = x->coordinate_kind,
                                        .parameter_values = s->value,
                                        .parameter_fixed = x->fixed,
                                        .input_values = x->inputs,
                                        .start = {.q = x->q, .qd = x->qd}};
    kmp_unit_token(unit->token, &(const kmp_unit_plan){.source = s, .on_library = true});
    unit->table = (kempe_fmu_model){.equations = &unit->equations,
                                    .token = unit->token,
                                    .kinds = KEMPE_FMU_CO_SIMULATION,
                                    .rtol = kmp_unit_rtol(unit->model),
                                    .atol = kmp_unit_atol(unit->model),
                                    .longest = kmp_unit_longest_step(unit->model)};
}

static kempe_status read_resources(library_unit *unit, const char *resources)
{
    char *text = NULL;
    size_t length = 0;
    if (!resources || !*resources)
        return kmp_fail(unit->context, KEMPE_E_ARGUMENT,
                        "the importer does not say where the resources of the unit are, which have the model");
    const char *folder = folder_of(&unit->arena, resources);
    const char *list = folder ? kmp_arena_printf(&unit->arena, "%s/%s", folder, KMP_UNIT_LIST) : NULL;
    KMP_TRY(kmp_made(unit->context, list));
    KMP_TRY(kmp_file_read(unit->context, KMP_FILE_RECORD, list, &text, &length));
    kempe_status status = read_list(unit, folder, text);
    kmp_free(text);
    return status;
}

static kempe_status make(library_unit *unit, const char *resources)
{
    KMP_TRY(read_resources(unit, resources));
    KMP_TRY(kempe_model_read_set(unit->context, unit->path, unit->settings, unit->setting_count, &unit->model));
    KMP_TRY(kempe_system_new(unit->model, &unit->system));
    KMP_TRY(kmp_source_describe(&unit->source, unit->model, unit->system));
    fill_table(unit);
    const int inputs = unit->source.input_count, parameters = unit->source.parameter_count;
    kempe_setting *room = KMP_ARENA_NEW(&unit->arena, kempe_setting, unit->setting_count + parameters);
    for (int k = 0; room && k < unit->setting_count; k++)
        room[k] = unit->settings[k];
    unit->settings = room;
    KMP_ARENA_MAKE(&unit->arena, KMP_ROOM(double, 3 * inputs, &unit->given),
                   KMP_ROOM(double, parameters, &unit->values));
    return kmp_made(unit->context, !unit->arena.failed);
}

/* -- mechanisms with other parameters ------------------------------------------------------------------ */

/* Frees the motion. */
static void stop(library_unit *unit)
{
    kempe_stepper_free(unit->stepper);
    kempe_outputs_free(unit->outputs);
    unit->stepper = NULL;
    unit->outputs = NULL;
}

static void forget_other(library_unit *unit)
{
    stop(unit);
    if (unit->set_up != unit->system)
        kempe_system_free(unit->set_up);
    kempe_model_free(unit->other);
    unit->set_up = NULL;
    unit->other = NULL;
}

/* Puts the mechanism with these parameters into unit->set_up; the model of the export where they are equal. */
static kempe_status put_parameters(library_unit *unit, const double *parameters)
{
    const kmp_code_source *s = &unit->source;
    const size_t bytes = (size_t)s->parameter_count * sizeof(double);
    int count = unit->setting_count;
    if (unit->set_up && (!bytes || memcmp(parameters, unit->values, bytes) == 0))
        return KEMPE_OK;
    forget_other(unit);
    for (int k = 0; k < s->parameter_count; k++)
        if (memcmp(&parameters[k], &s->value[k], sizeof(double)) != 0)
            unit->settings[count++] =
                (kempe_setting){s->parameter_name[k], kmp_arena_printf(&unit->arena, "%.17g", parameters[k])};
    KMP_TRY(kmp_made(unit->context, !unit->arena.failed));
    if (count > unit->setting_count) {
        KMP_TRY(kempe_model_read_set(unit->context, unit->path, unit->settings, count, &unit->other));
        KMP_TRY(kempe_system_new(unit->other, &unit->set_up));
    } else {
        unit->set_up = unit->system;
    }
    if (bytes)
        memcpy(unit->values, parameters, bytes);
    return KEMPE_OK;
}

/* -- instances ------------------------------------------------------------------------------------------- */

static void close_unit(const kempe_fmu_model *opened)
{
    library_unit *unit = (library_unit *)(void *)(uintptr_t)opened;
    forget_other(unit);
    kmp_source_free(&unit->source);
    kempe_system_free(unit->system);
    kempe_model_free(unit->model);
    kempe_context_free(unit->context);
    kmp_arena_free(&unit->arena);
    kmp_free(unit);
}

static const kempe_fmu_model *open_unit(const char *resources, char *sentence, size_t size)
{
    library_unit *unit = KMP_NEW(library_unit, 1);
    if (!unit || !(unit->context = kempe_context_new())) {
        kmp_free(unit);
        (void)snprintf(sentence, size, "There is no memory for the instance.");
        return NULL;
    }
    if (make(unit, resources) == KEMPE_OK) {
        return &unit->table;
    }
    (void)snprintf(sentence, size, "%s", kempe_context_message(unit->context));
    close_unit(&unit->table);
    return NULL;
}

const kempe_fmu_model kempe_fmu_exported = {.kinds = KEMPE_FMU_CO_SIMULATION, .open = open_unit, .close = close_unit};

/* A run needs an end: the tolerance of an importer without one. */
static const double without_end = 1e6;

static kempe_simulator_status fail(kempe_simulator *s, const char *sentence)
{
    (void)snprintf(s->message, sizeof s->message, "%s", sentence);
    return KEMPE_SIMULATOR_FAILED;
}

static kempe_simulator_status report(kempe_simulator *s)
{
    return fail(s, kempe_context_message(unit_of(s)->context));
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
    const size_t packed = kmp_stepper_packed_size(unit_of(&none)->system);
    return 2 * own_numbers(e) + HEAD + (int)((packed + sizeof(double) - 1) / sizeof(double));
}

void kempe_simulator_init(kempe_simulator *s, const kempe_equations *e, double *memory)
{
    *s = (kempe_simulator){.equations = e,
                           .memory = memory,
                           .settings = {.rtol = 1e-8, .atol = 1e-8, .end = INFINITY},
                           .numbers = kempe_simulator_memory(e)};
    library_unit *unit = unit_of(s);
    (void)place(s, e, memory);
    stop(unit);
    unit->before = (kempe_simulator_work){0};
    for (int k = 0; k < e->parameters; k++)
        s->p[k] = e->parameter_values[k];
    for (int k = 0; k < 3 * e->inputs; k++)
        s->u[k] = unit->given[k] = e->input_values[k];
}

/* -- the motion ---------------------------------------------------------------------------------------- */

/* The state of the stepper as a state of the simulator. */
static kempe_simulator_status show(kempe_simulator *s, kempe_status status)
{
    const kempe_equations *e = s->equations;
    const kempe_stepper *stepper = unit_of(s)->stepper;
    const size_t n = (size_t)e->coordinates * sizeof(double);
    if (!stepper || (status != KEMPE_OK && status != KEMPE_STOPPED))
        return report(s);
    s->t = stepper->t;
    memcpy(s->q, kempe_stepper_q(stepper), n);
    memcpy(s->qd, kempe_stepper_qd(stepper), n);
    memcpy(s->qdd, kempe_stepper_qdd(stepper), n);
    if (e->rows)
        memcpy(s->lambda, kempe_stepper_lambda(stepper), (size_t)e->rows * sizeof(double));
    const library_unit *unit = unit_of(s);
    const kempe_simulator_work *before = &unit->before;
    kmp_run_report r;
    kmp_runner_count(unit->stepper->runner, &r);
    s->work = (kempe_simulator_work){.steps = before->steps + (double)r.steps,
                                     .rejected = before->rejected + (double)r.rejected,
                                     .evaluations = before->evaluations + (double)r.rhs,
                                     .exchanges = before->exchanges + (double)r.exchanges,
                                     .events = before->events + (double)r.events};
    if (unit->outputs && kempe_outputs_at_stepper(unit->outputs, unit->stepper, s->y) != KEMPE_OK)
        return report(s);
    (void)snprintf(s->message, sizeof s->message, "%s", kempe_stepper_reason(stepper));
    return status == KEMPE_OK ? KEMPE_SIMULATOR_GOES : KEMPE_SIMULATOR_ENDED;
}

/* The same; without another message, the next doubt of the motion is the message. */
static kempe_simulator_status show_motion(kempe_simulator *s, kempe_status status)
{
    library_unit *unit = unit_of(s);
    const kempe_simulator_status shown = show(s, status);
    const char *doubts = kmp_context_doubts(unit->context);
    const char *line = doubts + (unit->reported < strlen(doubts) ? unit->reported : strlen(doubts));
    if (shown == KEMPE_SIMULATOR_FAILED || s->message[0] || !*line)
        return shown;
    (void)snprintf(s->message, sizeof s->message, "%.*s", (int)strcspn(line, "\n"), line);
    unit->reported += strcspn(line, "\n") + 1;
    return shown;
}

static kempe_status set_inputs(kempe_simulator *s)
{
    library_unit *unit = unit_of(s);
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
    library_unit *unit = unit_of(s);
    const double end = isfinite(s->settings.end) && s->settings.end > 0 ? s->settings.end : without_end;
    const kempe_run_options run = {.size = sizeof run,
                                   .rtol = s->settings.rtol,
                                   .atol = s->settings.atol,
                                   .fixed_step = s->settings.fixed_step,
                                   .max_step = s->settings.longest > 0 ? s->settings.longest : end,
                                   .t_end = end};
    stop(unit);
    memcpy(unit->given, s->equations->input_values, 3 * (size_t)s->equations->inputs * sizeof(double));
    KMP_TRY(put_parameters(unit, s->p));
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
    unit->reported = 0;
    return kempe_stepper_new(unit->set_up, &run, &unit->stepper);
}

/* Puts the motion where the model starts at given values (NaN: not given). */
static kempe_status place_stepper(library_unit *unit, const double *q, const double *qd)
{
    kempe_model *placed = NULL;
    kempe_system *system = NULL;
    kempe_stepper *there = NULL;
    kempe_status status = kempe_model_start_at(unit->other ? unit->other : unit->model, q, qd, &placed);
    if (status == KEMPE_OK)
        status = kempe_system_new(placed, &system);
    if (status == KEMPE_OK)
        status = kempe_stepper_new(system, NULL, &there);
    if (status == KEMPE_OK)
        status = kempe_stepper_set_state(unit->stepper, kempe_stepper_q(there), kempe_stepper_qd(there), NULL);
    kempe_stepper_free(there);
    kempe_system_free(system);
    kempe_model_free(placed);
    return status;
}

static bool are_given(const kempe_simulator *s, const double *given)
{
    bool any = false;
    for (int k = 0; given && k < s->equations->coordinates; k++)
        any = any || !isnan(given[k]);
    return any;
}

kempe_simulator_status kempe_simulator_start_from(kempe_simulator *s, double t, const double *q, const double *qd)
{
    library_unit *unit = unit_of(s);
    if (t != 0)
        return fail(s, "A unit on the library can only start at t = 0 s: choose this start time.");
    kempe_status status = begin(s);
    if (status == KEMPE_OK)
        status = set_inputs(s);
    if (status == KEMPE_OK && (are_given(s, q) || are_given(s, qd)))
        status = place_stepper(unit, q, qd);
    return show_motion(s, status);
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
    if (!unit_of(s)->stepper)
        return KEMPE_SIMULATOR_GOES;
    kempe_status status = set_inputs(s);
    return show(s, status == KEMPE_OK ? kmp_stepper_stand_with_inputs(unit_of(s)->stepper) : status);
}

kempe_simulator_status kempe_simulator_advance(kempe_simulator *s, double t)
{
    return show_motion(s, kempe_stepper_advance(unit_of(s)->stepper, t));
}

kempe_simulator_status kempe_simulator_step(kempe_simulator *s)
{
    return show_motion(s, kempe_stepper_step(unit_of(s)->stepper));
}

/* -- saved states -------------------------------------------------------------------------------------- */

/* The past of continuous delays has no constant length. */
int kempe_simulator_saved_numbers(const kempe_simulator *s)
{
    return unit_of(s)->source.model->delay_count > 0 ? 0 : s->numbers - own_numbers(s->equations);
}

/* The row of a simulator, which begins with q, and its parameters and inputs as the stepper has them. */
static void list_arrays(kempe_simulator *s, kmp_memory_piece piece[3])
{
    library_unit *unit = unit_of(s);
    piece[0] = (kmp_memory_piece){unit->values, (size_t)s->equations->parameters};
    piece[1] = (kmp_memory_piece){unit->given, 3 * (size_t)s->equations->inputs};
    piece[2] = (kmp_memory_piece){s->q, (size_t)row_size(s->equations)};
}

void kempe_simulator_save(const kempe_simulator *s, double *to)
{
    library_unit *unit = unit_of(s);
    kempe_simulator copy = *s;
    kempe_stepper_state *state = NULL;
    kmp_memory_piece piece[3];
    const int numbers = kempe_simulator_saved_numbers(s);
    memset(to, 0, (size_t)numbers * sizeof *to);
    if (!unit->stepper || numbers == 0 || kempe_stepper_save(unit->stepper, &state) != KEMPE_OK)
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
    library_unit *unit = unit_of(s);
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
    library_unit *unit = unit_of(s);
    const size_t parameters = (size_t)s->equations->parameters * sizeof(double);
    const bool other = parameters > 0 && memcmp(from + HEAD, unit->values, parameters) != 0;
    kmp_memory_piece piece[3];
    saved_head head;
    memcpy(&head, from, sizeof head);
    if (head.started == 0 || other || memcmp(&head.settings, &s->settings, sizeof head.settings) != 0)
        stop(unit);
    if (head.started == 0)
        return;
    s->settings = head.settings;
    if (parameters)
        memcpy(s->p, from + HEAD, parameters);
    const double *packed = from + HEAD + own_numbers(s->equations);
    if (continue_from(s, (const unsigned char *)packed) != KEMPE_OK) {
        (void)report(s);
        stop(unit);
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

void kempe_simulator_report(kempe_simulator *s)
{
    s->message[0] = 0;
}

int kempe_simulator_wants_update(const kempe_simulator *s)
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
