/* SPDX-License-Identifier: BSD-3-Clause */
/* The part of a functional mock-up unit that both versions of the FMI share: kempe_fmu.h explains it. An instance knows
 * what the importer has set since the simulator was evaluated, and evaluates it when values are read. */
#include "kempe_fmu.h"
#include "constraints/tolerances.h"
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

/* -- messages -------------------------------------------------------------------------------------------- */

const char *const kempe_fmu_categories[KEMPE_FMU_LOG_CATEGORIES + 1] = {
    "logEvents", "logStatusWarning", "logStatusDiscard", "logStatusError", "logSteps", "logAll"};

kempe_fmu_status kempe_fmu_say(kempe_fmu *fmu, kempe_fmu_status status, int category, const char *format, ...)
{
    char sentence[KEMPE_FMU_SENTENCE];
    va_list arguments;
    if (!fmu->log || (status == KEMPE_FMU_OK && !(fmu->logged & 1u << category)))
        return status;
    va_start(arguments, format);
    (void)vsnprintf(sentence, sizeof sentence, format, arguments);
    va_end(arguments);
    fmu->log(fmu, status, kempe_fmu_categories[category], sentence);
    return status;
}

#define FAIL(...)    kempe_fmu_say(fmu, KEMPE_FMU_ERROR, KEMPE_FMU_LOG_ERROR, __VA_ARGS__)
#define DISCARD(...) kempe_fmu_say(fmu, KEMPE_FMU_DISCARD, KEMPE_FMU_LOG_DISCARD, __VA_ARGS__)

static const char *mode_name(int mode)
{
    return mode == KEMPE_FMU_INSTANTIATED     ? "Instantiated"
           : mode == KEMPE_FMU_INITIALIZATION ? "Initialization Mode"
           : mode == KEMPE_FMU_EVENT          ? "Event Mode"
           : mode == KEMPE_FMU_CONTINUOUS     ? "Continuous-Time Mode"
           : mode == KEMPE_FMU_STEP           ? "Step Mode"
           : mode == KEMPE_FMU_INTERMEDIATE   ? "Intermediate Update Mode"
                                              : "Terminated";
}

int kempe_fmu_allows(kempe_fmu *fmu, int modes, const char *function)
{
    if (!fmu)
        return 0;
    if (fmu->now.mode & modes)
        return 1;
    (void)FAIL("%s is not allowed in the state '%s' of the instance: see the state machine of the FMI standard.",
               function, mode_name(fmu->now.mode));
    return 0;
}

kempe_fmu_status kempe_fmu_choose_categories(kempe_fmu *fmu, int on, size_t count, const char *const *names)
{
    const unsigned all = (1u << KEMPE_FMU_LOG_CATEGORIES) - 1u;
    unsigned chosen = count ? 0 : all;
    for (size_t i = 0; i < count; i++) {
        int c = 0;
        while (c <= KEMPE_FMU_LOG_CATEGORIES && (!names || !names[i] || strcmp(kempe_fmu_categories[c], names[i]) != 0))
            c++;
        if (c > KEMPE_FMU_LOG_CATEGORIES)
            return FAIL("The category '%s' of messages does not exist: modelDescription.xml lists the categories.",
                        names && names[i] ? names[i] : "");
        chosen |= c == KEMPE_FMU_LOG_CATEGORIES ? all : 1u << c;
    }
    fmu->logged = on ? fmu->logged | chosen : fmu->logged & ~chosen;
    return KEMPE_FMU_OK;
}

/* -- memory ---------------------------------------------------------------------------------------------- */

/* Places the arrays one after the other; returns their number of doubles. `fmu` NULL: only counts. */
static int place(kempe_fmu *fmu, const kempe_equations *e, double *memory)
{
    struct kempe_fmu_numbers unused, *part = fmu ? &fmu->part : &unused;
    const int n = e->coordinates, f = e->freedom, c = e->conditions;
    double *choice = NULL;
    struct {
        double **array;
        int count;
    } arrays[] = {{&part->x, 2 * f},
                  {&part->start, 2 * n},
                  {&part->given, 2 * n},
                  {&part->held, c},
                  {&part->value, c},
                  {&part->kept, kempe_simulator_memory(e)},
                  {&part->along_x, 2 * f},
                  {&part->along_p, e->parameters},
                  {&part->along_u, 3 * e->inputs},
                  {&part->dx, 2 * f},
                  {&part->states, 2 * f},
                  {&part->q, n},
                  {&part->qd, n},
                  {&part->qdd, n},
                  {&part->lambda, e->rows},
                  {&part->y, e->outputs},
                  {&part->dvalue, c},
                  {&choice, f}};
    int used = 0;
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) {
        if (memory)
            *arrays[i].array = memory + used;
        used += arrays[i].count;
    }
    part->choice = (int *)(void *)choice;
    return used;
}

void kempe_fmu_close(const kempe_fmu_model *model)
{
    if (model && kempe_fmu_exported.close)
        kempe_fmu_exported.close(model);
}

const kempe_fmu_model *kempe_fmu_open(const char *name, const char *token, int kind, const char *resources,
                                      char sentence[KEMPE_FMU_SENTENCE])
{
    const kempe_fmu_model *model = &kempe_fmu_exported;
    const char *missing = NULL;
    sentence[0] = 0;
    if (!name || !name[0])
        missing = "The name of the instance is missing.";
    else if (model->open)
        model = model->open(resources, sentence, KEMPE_FMU_SENTENCE);
    if (!model)
        return NULL;
    if (!missing && (!token || strcmp(token, model->token) != 0))
        missing = "The guid or instantiation token belongs to another unit: it differs from modelDescription.xml.";
    else if (!missing && !(model->kinds & (unsigned)kind))
        missing = "The unit was exported without this kind of simulation.";
    if (!missing)
        return model;
    if (model != &kempe_fmu_exported)
        kempe_fmu_close(model);
    snprintf(sentence, KEMPE_FMU_SENTENCE, "%s", missing);
    return NULL;
}

int kempe_fmu_memory(const kempe_fmu_model *model)
{
    return kempe_simulator_memory(model->equations) + place(NULL, model->equations, NULL);
}

void kempe_fmu_reset(kempe_fmu *fmu)
{
    const kempe_equations *e = fmu->model->equations;
    kempe_simulator *s = &fmu->simulator;
    const size_t n = (size_t)e->coordinates;
    kempe_simulator_init(s, e, s->memory);
    s->settings.rtol = fmu->model->rtol;
    s->settings.atol = fmu->model->atol;
    s->settings.longest = fmu->model->longest;
    memset(&fmu->now, 0, sizeof fmu->now);
    fmu->now.mode = KEMPE_FMU_INSTANTIATED;
    fmu->now.stop = INFINITY;
    memcpy(fmu->part.start, e->start.q, n * sizeof(double));
    memcpy(fmu->part.start + n, e->start.qd, n * sizeof(double));
}

void kempe_fmu_init(kempe_fmu *fmu, const kempe_fmu_model *model, int kind, double *memory)
{
    const int numbers = kempe_fmu_memory(model);
    for (int i = 0; i < numbers; i++)
        memory[i] = 0;
    fmu->model = model;
    fmu->kind = kind;
    memset(&fmu->simulator, 0, sizeof fmu->simulator);
    fmu->simulator.memory = memory;
    (void)place(fmu, model->equations, memory + kempe_simulator_memory(model->equations));
    kempe_fmu_reset(fmu);
}

static void copy(double *to, const double *from, int count)
{
    for (int i = 0; i < count; i++)
        to[i] = from[i];
}

/* -- start of a motion, and the simulator with all that was set ------------------------------------------ */

kempe_fmu_status kempe_fmu_set_up(kempe_fmu *fmu, int tolerance_given, double tolerance, double start, int stop_given,
                                  double stop)
{
    if (!isfinite(start) || (stop_given && !(stop >= start)))
        return FAIL("The start time %g s and the stop time %g s are not an interval of time.", start,
                    stop_given ? stop : INFINITY);
    if (tolerance_given && !(tolerance > 0 && tolerance < 1))
        return FAIL("The tolerance %g is not between 0 and 1.", tolerance);
    fmu->now.t = start;
    fmu->now.stop = stop_given ? stop : INFINITY;
    fmu->now.started = 0;
    if (tolerance_given) {
        fmu->simulator.settings.rtol = tolerance;
        fmu->simulator.settings.atol = tolerance;
    }
    return KEMPE_FMU_OK;
}

static int same_bits(double a, double b)
{
    return !memcmp(&a, &b, sizeof a);
}

/* Collects the start values that differ from the unit's own ones: the importer has given these. 1: there are any. */
static int collect_given(kempe_fmu *fmu)
{
    const kempe_equations *e = fmu->model->equations;
    const int n = e->coordinates;
    int any = 0;
    for (int j = 0; j < 2 * n; j++) {
        const int own = same_bits(fmu->part.start[j], j < n ? e->start.q[j] : e->start.qd[j - n]);
        fmu->part.given[j] = own ? NAN : fmu->part.start[j];
        any |= !own;
    }
    return any;
}

/* Computes the start again, with the parameters, inputs and settings as they are. */
static kempe_fmu_status start(kempe_fmu *fmu)
{
    const kempe_equations *e = fmu->model->equations;
    kempe_simulator *s = &fmu->simulator;
    const kempe_simulator_settings settings = s->settings;
    copy(fmu->part.along_p, s->p, e->parameters);
    copy(fmu->part.along_u, s->u, 3 * e->inputs);
    kempe_simulator_init(s, e, s->memory);
    copy(s->p, fmu->part.along_p, e->parameters);
    copy(s->u, fmu->part.along_u, 3 * e->inputs);
    s->settings = settings;
    s->settings.end = fmu->now.stop;
    kempe_simulator_status status = kempe_simulator_set_parameters(s);
    if (status == KEMPE_SIMULATOR_GOES)
        status = kempe_simulator_set_inputs(s);
    fmu->now.placed = collect_given(fmu);
    if (status == KEMPE_SIMULATOR_GOES)
        status = kempe_simulator_start_from(s, fmu->now.t, fmu->part.given, fmu->part.given + e->coordinates);
    if (status == KEMPE_SIMULATOR_FAILED)
        return FAIL("%s", s->message);
    fmu->now.ended = status == KEMPE_SIMULATOR_ENDED;
    if (s->message[0]) /* the end, or what makes the motion not trustworthy */
        (void)kempe_fmu_say(fmu, KEMPE_FMU_WARNING, KEMPE_FMU_LOG_WARNING, "%s", s->message);
    fmu->now.started = 1;
    fmu->now.moved = fmu->now.pressed = fmu->now.tuned = 0;
    kempe_simulator_get_states(s, fmu->part.x);
    return KEMPE_FMU_OK;
}

kempe_fmu_status kempe_fmu_enter_initialization(kempe_fmu *fmu)
{
    fmu->now.mode = KEMPE_FMU_INITIALIZATION;
    fmu->now.started = 0;
    return KEMPE_FMU_OK;
}

kempe_fmu_status kempe_fmu_exit_initialization(kempe_fmu *fmu, int mode)
{
    kempe_fmu_status status = kempe_fmu_refresh(fmu);
    if (status == KEMPE_FMU_OK)
        fmu->now.mode = mode;
    return status;
}

kempe_fmu_status kempe_fmu_refresh(kempe_fmu *fmu)
{
    kempe_simulator *s = &fmu->simulator;
    if (!fmu->now.started)
        return start(fmu);
    if (fmu->kind == KEMPE_FMU_CO_SIMULATION) {
        if ((fmu->now.pressed || fmu->now.tuned) && kempe_simulator_set_inputs(s) == KEMPE_SIMULATOR_FAILED)
            return DISCARD("%s", s->message);
    } else if (fmu->now.tuned && kempe_simulator_set_parameters(s) == KEMPE_SIMULATOR_FAILED) {
        return DISCARD("%s", s->message);
    } else if (fmu->now.moved || fmu->now.pressed || fmu->now.tuned) {
        if (kempe_simulator_set_states(s, fmu->now.t, fmu->part.x) == KEMPE_SIMULATOR_FAILED)
            return DISCARD("%s", s->message);
    }
    fmu->now.moved = fmu->now.pressed = fmu->now.tuned = 0;
    return KEMPE_FMU_OK;
}

/* -- variables ------------------------------------------------------------------------------------------- */

/* Variables of one block: their numbers at the present state, and their names as a person reads them. */
typedef struct kempe_fmu_variables {
    int size;
    const double *values;
    const char *const *names;
} kempe_fmu_variables;

static kempe_fmu_variables variables_of(kempe_fmu *fmu, int block)
{
    static const char *const settings[KEMPE_FMU_SETTINGS_COUNT] = {"solver.rtol", "solver.atol", "solver.fixed_step",
                                                                   "solver.longest_step"};
    static const char *const time[] = {"time"};
    const kempe_equations *e = fmu->model->equations;
    const kempe_simulator *s = &fmu->simulator;
    const int n = e->coordinates, f = e->freedom;
    const kempe_fmu_variables blocks[KEMPE_FMU_BLOCKS] = {
        [KEMPE_FMU_TIME] = {1, fmu->kind == KEMPE_FMU_CO_SIMULATION && fmu->now.started ? &s->t : &fmu->now.t, time},
        [KEMPE_FMU_STATES] = {2 * f, s->part.x, NULL},
        [KEMPE_FMU_RATES] = {2 * f, s->part.rates, NULL},
        [KEMPE_FMU_Q] = {n, s->q, e->coordinate_names},
        [KEMPE_FMU_QD] = {n, s->qd, e->coordinate_names},
        [KEMPE_FMU_QDD] = {n, s->qdd, e->coordinate_names},
        [KEMPE_FMU_LAMBDA] = {e->rows, s->lambda, e->row_names},
        [KEMPE_FMU_OUTPUTS] = {e->outputs, s->y, e->output_names},
        [KEMPE_FMU_INPUTS] = {3 * e->inputs, s->u, e->input_names},
        [KEMPE_FMU_PARAMETERS] = {e->parameters, s->p, e->parameter_names},
        [KEMPE_FMU_CONDITIONS] = {e->conditions, fmu->part.value, e->condition_names},
        [KEMPE_FMU_SETTINGS] = {KEMPE_FMU_SETTINGS_COUNT, NULL, settings},
        [KEMPE_FMU_CHOICE] = {f, NULL, NULL},
        [KEMPE_FMU_WORK] = {KEMPE_FMU_WORK_COUNT, NULL, NULL}};
    return blocks[block];
}

/* The block of a value reference and the place in it; -1: none. */
static int block_of(kempe_fmu *fmu, unsigned reference, int *at)
{
    const unsigned block = reference / KEMPE_FMU_BLOCK;
    *at = (int)(reference % KEMPE_FMU_BLOCK);
    return block < KEMPE_FMU_BLOCKS && *at < variables_of(fmu, (int)block).size ? (int)block : -1;
}

static kempe_fmu_status unknown(kempe_fmu *fmu, unsigned reference, const char *type)
{
    return FAIL("The value reference %u is not one of a variable of type %s: modelDescription.xml lists them.",
                reference, type);
}

static double *setting(kempe_fmu *fmu, int at)
{
    kempe_simulator_settings *settings = &fmu->simulator.settings;
    double *all[KEMPE_FMU_SETTINGS_COUNT] = {&settings->rtol, &settings->atol, &settings->fixed_step,
                                             &settings->longest};
    return all[at];
}

static const char *name_of(kempe_fmu *fmu, int block, int at)
{
    const char *const *names = variables_of(fmu, block).names;
    return names ? names[block == KEMPE_FMU_INPUTS ? at / 3 : at] : "x";
}

/* The block as numbers at the present state. */
static const double *values_of(kempe_fmu *fmu, int block)
{
    if (block == KEMPE_FMU_CONDITIONS)
        kempe_simulator_get_changes(&fmu->simulator, fmu->part.value);
    return variables_of(fmu, block).values;
}

kempe_fmu_status kempe_fmu_get(kempe_fmu *fmu, const unsigned *references, size_t count, double *values)
{
    const double *array = NULL;
    int current = -1;
    for (size_t i = 0; i < count; i++) {
        int at = 0;
        const int block = references && values ? block_of(fmu, references[i], &at) : -1;
        if (block < 0 || block >= KEMPE_FMU_CHOICE)
            return unknown(fmu, references ? references[i] : 0, "Real or Float64");
        const int given = block == KEMPE_FMU_TIME || block == KEMPE_FMU_INPUTS || block == KEMPE_FMU_PARAMETERS;
        if (block == KEMPE_FMU_SETTINGS) {
            values[i] = *setting(fmu, at);
            continue;
        }
        if (fmu->now.mode == KEMPE_FMU_INSTANTIATED && (block == KEMPE_FMU_Q || block == KEMPE_FMU_QD)) {
            values[i] = fmu->part.start[at + (block == KEMPE_FMU_QD ? fmu->model->equations->coordinates : 0)];
            continue;
        }
        if (!given) {
            if (fmu->now.mode == KEMPE_FMU_INSTANTIATED)
                return FAIL("The variable '%s' has no value yet: enter Initialization Mode first.",
                            name_of(fmu, block, at));
            kempe_fmu_status status = kempe_fmu_refresh(fmu);
            if (status != KEMPE_FMU_OK)
                return status;
        }
        if (block != current)
            array = values_of(fmu, current = block);
        values[i] = array[at];
    }
    return KEMPE_FMU_OK;
}

kempe_fmu_status kempe_fmu_get_integers(kempe_fmu *fmu, const unsigned *references, size_t count, int *values)
{
    const kempe_simulator *s = &fmu->simulator;
    const double work[KEMPE_FMU_WORK_COUNT] = {s->work.exchanges, s->work.events, s->work.steps, s->work.evaluations};
    for (size_t i = 0; i < count; i++) {
        int at = 0;
        const int block = references && values ? block_of(fmu, references[i], &at) : -1;
        if (block < KEMPE_FMU_CHOICE)
            return unknown(fmu, references ? references[i] : 0, "Integer or Int32");
        if (block == KEMPE_FMU_WORK) {
            values[i] = work[at] < 2147483647.0 ? (int)work[at] : 2147483647;
            continue;
        }
        if (fmu->now.mode == KEMPE_FMU_INSTANTIATED)
            return FAIL("The independent coordinates are not chosen yet: enter Initialization Mode first.");
        kempe_fmu_status status = kempe_fmu_refresh(fmu);
        if (status != KEMPE_FMU_OK)
            return status;
        kempe_simulator_get_choice(s, fmu->part.choice);
        values[i] = fmu->part.choice[at] + 1;
    }
    return KEMPE_FMU_OK;
}

kempe_fmu_status kempe_fmu_no_variables(kempe_fmu *fmu, size_t count, const unsigned *references, const char *type)
{
    return count ? unknown(fmu, references ? references[0] : 0, type) : KEMPE_FMU_OK;
}

/* Checks that a variable may be set in the present mode. */
static kempe_fmu_status check_set(kempe_fmu *fmu, int block, int at, double value)
{
    const int early = fmu->now.mode & (KEMPE_FMU_INSTANTIATED | KEMPE_FMU_INITIALIZATION);
    const char *name = name_of(fmu, block, at);
    switch (block) {
    case KEMPE_FMU_INPUTS:
        if (fmu->now.mode == KEMPE_FMU_INTERMEDIATE)
            return FAIL("The input '%s' cannot be set during an intermediate update.", name);
        break;
    case KEMPE_FMU_PARAMETERS:
        if (!early && fmu->model->equations->parameter_fixed[at])
            return FAIL("The parameter '%s' is fixed, because the loops depend on it: set it before the end of "
                        "initialisation.",
                        name);
        if (!early && !(fmu->now.mode & (KEMPE_FMU_EVENT | KEMPE_FMU_STEP)))
            return FAIL("The parameter '%s' can be set in Event Mode and Step Mode, not in the state '%s'.", name,
                        mode_name(fmu->now.mode));
        break;
    case KEMPE_FMU_SETTINGS:
        if (!early)
            return FAIL("The setting '%s' is fixed: set it before the end of initialisation.", name);
        if (!(value > 0 || (value == 0 && at > 1)))
            return FAIL("The setting '%s' cannot be %g: it has a positive value.", name, value);
        break;
    case KEMPE_FMU_Q:
    case KEMPE_FMU_QD:
        if (!early)
            return FAIL("The start value of the coordinate '%s' can only be set before the end of initialisation.",
                        name);
        break;
    default:
        return FAIL("The variable '%s' is computed: it cannot be set.", name);
    }
    return isfinite(value) ? KEMPE_FMU_OK
                           : FAIL("The value %g of the variable '%s' is not a finite number.", value, name);
}

kempe_fmu_status kempe_fmu_set(kempe_fmu *fmu, const unsigned *references, size_t count, const double *values)
{
    kempe_simulator *s = &fmu->simulator;
    for (size_t i = 0; i < count; i++) { /* all or none */
        int at = 0;
        const int block = references && values ? block_of(fmu, references[i], &at) : -1;
        if (block < 0 || block >= KEMPE_FMU_CHOICE)
            return unknown(fmu, references ? references[i] : 0, "Real or Float64");
        kempe_fmu_status status = check_set(fmu, block, at, values[i]);
        if (status != KEMPE_FMU_OK)
            return status;
    }
    for (size_t i = 0; i < count; i++) {
        int at = 0;
        const int block = block_of(fmu, references[i], &at), n = fmu->model->equations->coordinates;
        double *place = block == KEMPE_FMU_INPUTS       ? s->u + at
                        : block == KEMPE_FMU_PARAMETERS ? s->p + at
                        : block == KEMPE_FMU_SETTINGS   ? setting(fmu, at)
                                                        : fmu->part.start + at + (block == KEMPE_FMU_QD ? n : 0);
        if (same_bits(*place, values[i]))
            continue;
        *place = values[i];
        fmu->now.pressed |= block == KEMPE_FMU_INPUTS;
        fmu->now.tuned |= block == KEMPE_FMU_PARAMETERS;
        if (fmu->now.mode & (KEMPE_FMU_INSTANTIATED | KEMPE_FMU_INITIALIZATION))
            fmu->now.started = 0;
    }
    return KEMPE_FMU_OK;
}

/* -- saved states ---------------------------------------------------------------------------------------- */

/* A saved state: hash of the model, its bytes, then the pieces below, whose sum is checked. */
typedef struct kempe_fmu_head {
    char hash[24];
    size_t bytes;
    unsigned long sum;
    int kind;
} kempe_fmu_head;

/* The bytes of a state. `to`: saves it there; `from`: restores it, the simulator before what it is to take; NULL: does
 * not. */
static size_t transfer(kempe_fmu *fmu, unsigned char *to, const unsigned char *from)
{
    const kempe_equations *e = fmu->model->equations;
    kempe_simulator *s = &fmu->simulator;
    const struct {
        void *at;
        size_t bytes;
    } piece[] = {{fmu->part.kept, (size_t)kempe_simulator_saved_numbers(s) * sizeof(double)},
                 {&fmu->now, sizeof fmu->now},
                 {&s->settings, sizeof s->settings},
                 {fmu->part.x, 2 * (size_t)e->freedom * sizeof(double)},
                 {fmu->part.start, 2 * (size_t)e->coordinates * sizeof(double)},
                 {s->p, (size_t)e->parameters * sizeof(double)},
                 {s->u, 3 * (size_t)e->inputs * sizeof(double)}};
    size_t used = sizeof(kempe_fmu_head);
    if (to)
        kempe_simulator_save(s, fmu->part.kept);
    for (size_t i = 0; i < sizeof piece / sizeof *piece; used += piece[i++].bytes) {
        if (to && piece[i].bytes)
            memcpy(to + used, piece[i].at, piece[i].bytes);
        else if (from && piece[i].bytes)
            memcpy(piece[i].at, from + used, piece[i].bytes);
        if (from && i == 0)
            kempe_simulator_restore(s, fmu->part.kept);
    }
    return used;
}

kempe_fmu_status kempe_fmu_saves_states(kempe_fmu *fmu)
{
    if (kempe_simulator_saved_numbers(&fmu->simulator) > 0)
        return KEMPE_FMU_OK;
    return FAIL("This unit saves no states, as its description says: the past of delayed signals is not part of a "
                "state.");
}

size_t kempe_fmu_state_bytes(kempe_fmu *fmu)
{
    return transfer(fmu, NULL, NULL);
}

/* Adler's sum of the bytes after the head. */
static unsigned long sum_of(const unsigned char *state, size_t size)
{
    unsigned long a = 1, b = 0;
    for (size_t i = sizeof(kempe_fmu_head); i < size;) {
        const size_t end = size - i > 5000 ? i + 5000 : size; /* no overflow of 32 bits before the remainder */
        for (; i < end; i++) {
            a += state[i];
            b += a;
        }
        a %= 65521;
        b %= 65521;
    }
    return b << 16 | a;
}

/* The head of a state of this unit with the bytes after it. */
static kempe_fmu_head head_of(kempe_fmu *fmu, const unsigned char *state)
{
    kempe_fmu_head head;
    memset(&head, 0, sizeof head);
    (void)snprintf(head.hash, sizeof head.hash, "%s", fmu->model->equations->hash);
    head.bytes = kempe_fmu_state_bytes(fmu);
    head.sum = sum_of(state, head.bytes);
    head.kind = fmu->kind;
    return head;
}

void kempe_fmu_save(kempe_fmu *fmu, unsigned char *to)
{
    (void)transfer(fmu, to, NULL);
    const kempe_fmu_head head = head_of(fmu, to);
    memcpy(to, &head, sizeof head);
}

kempe_fmu_status kempe_fmu_check_state(kempe_fmu *fmu, const unsigned char *bytes, size_t size)
{
    const int fits = bytes && size == kempe_fmu_state_bytes(fmu);
    kempe_fmu_head head;
    if (fits)
        head = head_of(fmu, bytes);
    if (!fits || memcmp(bytes, &head, sizeof head) != 0)
        return FAIL("The %lu bytes are not a state of this unit: a state belongs to the model and the kind of instance "
                    "that it was taken from.",
                    (unsigned long)size);
    return KEMPE_FMU_OK;
}

kempe_fmu_status kempe_fmu_restore(kempe_fmu *fmu, const unsigned char *from)
{
    const kempe_fmu_status status = kempe_fmu_check_state(fmu, from, kempe_fmu_state_bytes(fmu));
    if (!from || status != KEMPE_FMU_OK)
        return KEMPE_FMU_ERROR;
    (void)transfer(fmu, NULL, from);
    return KEMPE_FMU_OK;
}

/* -- directional, adjoint and time derivatives ----------------------------------------------------------- */

static void clear(double *array, int count)
{
    for (int i = 0; i < count; i++)
        array[i] = 0;
}

/* A direction without any change, and the places of what changes along it. */
static kempe_simulator_change no_change(kempe_fmu *fmu)
{
    const kempe_equations *e = fmu->model->equations;
    kempe_simulator_change change;
    memset(&change, 0, sizeof change);
    clear(fmu->part.along_x, 2 * e->freedom);
    clear(fmu->part.along_p, e->parameters);
    clear(fmu->part.along_u, 3 * e->inputs);
    change.t = 0;
    if (fmu->now.mode == KEMPE_FMU_INITIALIZATION) /* the start follows from what the importer sets */
        change.start = fmu->now.placed ? KEMPE_CHANGE_START_FROM : KEMPE_CHANGE_START;
    change.given_q = fmu->part.given;
    change.given_qd = fmu->part.given + e->coordinates;
    change.x = fmu->part.along_x;
    change.p = fmu->part.along_p;
    change.u = fmu->part.along_u;
    change.dx = fmu->part.dx;
    change.states = fmu->part.states;
    change.q = fmu->part.q;
    change.qd = fmu->part.qd;
    change.qdd = fmu->part.qdd;
    change.lambda = fmu->part.lambda;
    change.y = fmu->part.y;
    change.value = fmu->part.dvalue;
    return change;
}

static kempe_fmu_status add_known(kempe_fmu *fmu, kempe_simulator_change *change, unsigned reference, double by)
{
    double *const knowns[KEMPE_FMU_BLOCKS] = {[KEMPE_FMU_TIME] = &change->t,
                                              [KEMPE_FMU_STATES] = fmu->part.along_x,
                                              [KEMPE_FMU_PARAMETERS] = fmu->part.along_p,
                                              [KEMPE_FMU_INPUTS] = fmu->part.along_u};
    int at = 0;
    const int block = block_of(fmu, reference, &at);
    if (block < 0 || !knowns[block])
        return FAIL("The value reference %u is not one of time, a state, an input or a parameter: no derivatives with "
                    "respect to it are defined.",
                    reference);
    knowns[block][at] += by;
    return KEMPE_FMU_OK;
}

/* The place of the change of an unknown; NULL after a sentence: none. */
static const double *change_of(kempe_fmu *fmu, const kempe_simulator_change *change, unsigned reference)
{
    const double *const unknowns[KEMPE_FMU_BLOCKS] = {
        [KEMPE_FMU_STATES] = change->states, [KEMPE_FMU_RATES] = change->dx,        [KEMPE_FMU_Q] = change->q,
        [KEMPE_FMU_QD] = change->qd,         [KEMPE_FMU_QDD] = change->qdd,         [KEMPE_FMU_LAMBDA] = change->lambda,
        [KEMPE_FMU_OUTPUTS] = change->y,     [KEMPE_FMU_CONDITIONS] = change->value};
    int at = 0;
    const int block = block_of(fmu, reference, &at);
    if (block >= 0 && unknowns[block])
        return unknowns[block] + at;
    (void)FAIL("The value reference %u is not one of a computed variable of type Real or Float64: it has no "
               "derivatives.",
               reference);
    return NULL;
}

static kempe_fmu_status pass(kempe_fmu *fmu, const kempe_simulator_change *change)
{
    return kempe_simulator_along(&fmu->simulator, change) == KEMPE_SIMULATOR_GOES ? KEMPE_FMU_OK
                                                                                  : FAIL("%s", fmu->simulator.message);
}

/* Present values, and all references known. */
static kempe_fmu_status begin_derivatives(kempe_fmu *fmu, const unsigned *unknowns, size_t unknown_count,
                                          const unsigned *knowns, size_t known_count)
{
    kempe_fmu_status status = kempe_fmu_refresh(fmu);
    kempe_simulator_change change = no_change(fmu);
    kempe_simulator_get_choice(&fmu->simulator, fmu->part.choice);
    for (size_t i = 0; i < known_count && status == KEMPE_FMU_OK; i++)
        status = add_known(fmu, &change, knowns[i], 0);
    for (size_t i = 0; i < unknown_count && status == KEMPE_FMU_OK; i++)
        status = change_of(fmu, &change, unknowns[i]) ? KEMPE_FMU_OK : KEMPE_FMU_ERROR;
    return status;
}

kempe_fmu_status kempe_fmu_directional(kempe_fmu *fmu, const unsigned *unknowns, size_t unknown_count,
                                       const unsigned *knowns, size_t known_count, const double *seed,
                                       double *sensitivity)
{
    kempe_fmu_status status = begin_derivatives(fmu, unknowns, unknown_count, knowns, known_count);
    if (status != KEMPE_FMU_OK)
        return status;
    kempe_simulator_change change = no_change(fmu);
    for (size_t i = 0; i < known_count; i++)
        (void)add_known(fmu, &change, knowns[i], seed[i]);
    status = pass(fmu, &change);
    for (size_t i = 0; i < unknown_count && status == KEMPE_FMU_OK; i++)
        sensitivity[i] = *change_of(fmu, &change, unknowns[i]);
    return status;
}

kempe_fmu_status kempe_fmu_adjoint(kempe_fmu *fmu, const unsigned *unknowns, size_t unknown_count,
                                   const unsigned *knowns, size_t known_count, const double *seed, double *sensitivity)
{
    kempe_fmu_status status = begin_derivatives(fmu, unknowns, unknown_count, knowns, known_count);
    for (size_t k = 0; k < known_count && status == KEMPE_FMU_OK; k++) {
        kempe_simulator_change change = no_change(fmu);
        double sum = 0;
        (void)add_known(fmu, &change, knowns[k], 1);
        status = pass(fmu, &change);
        for (size_t i = 0; i < unknown_count && status == KEMPE_FMU_OK; i++)
            sum += seed[i] * *change_of(fmu, &change, unknowns[i]);
        if (status == KEMPE_FMU_OK)
            sensitivity[k] = sum;
    }
    return status;
}

kempe_fmu_status kempe_fmu_output_rates(kempe_fmu *fmu, const unsigned *references, size_t count, const int *orders,
                                        double *values)
{
    for (size_t i = 0; i < count; i++)
        if (!references || !orders || !values || orders[i] != 1)
            return FAIL("Derivatives of outputs with respect to time are available for order 1, not %d.",
                        orders ? orders[i] : 0);
    kempe_fmu_status status = begin_derivatives(fmu, references, count, NULL, 0);
    if (status != KEMPE_FMU_OK || !count)
        return status;
    kempe_simulator_change change = no_change(fmu);
    change.t = 1;
    kempe_simulator_get_rates(&fmu->simulator, fmu->part.along_x);
    status = pass(fmu, &change);
    for (size_t i = 0; i < count && status == KEMPE_FMU_OK; i++)
        values[i] = *change_of(fmu, &change, references[i]);
    return status;
}

/* -- model exchange: the importer integrates ------------------------------------------------------------- */

kempe_fmu_status kempe_fmu_set_time(kempe_fmu *fmu, double t)
{
    if (!isfinite(t))
        return FAIL("The time %g is not a finite number.", t);
    fmu->now.moved |= !same_bits(fmu->now.t, t);
    fmu->now.t = t;
    return KEMPE_FMU_OK;
}

static kempe_fmu_status check_count(kempe_fmu *fmu, const void *array, size_t count, int expected, const char *what)
{
    return count == (size_t)expected && (array || !count)
               ? KEMPE_FMU_OK
               : FAIL("The model has %d %s, and %lu are given.", expected, what, array ? (unsigned long)count : 0ul);
}

kempe_fmu_status kempe_fmu_set_states(kempe_fmu *fmu, const double *x, size_t count)
{
    kempe_fmu_status status = check_count(fmu, x, count, 2 * fmu->model->equations->freedom, "continuous states");
    for (size_t i = 0; i < count && status == KEMPE_FMU_OK; i++)
        if (!isfinite(x[i]))
            status =
                DISCARD("The continuous state %lu is not a finite number: take a smaller step.", (unsigned long)i + 1);
    for (size_t i = 0; i < count && status == KEMPE_FMU_OK; i++) {
        fmu->now.moved |= !same_bits(fmu->part.x[i], x[i]);
        fmu->part.x[i] = x[i];
    }
    return status;
}

/* Copies an array of the present state. */
static kempe_fmu_status give(kempe_fmu *fmu, int block, double *to, size_t count, const char *what)
{
    kempe_fmu_status status = check_count(fmu, to, count, variables_of(fmu, block).size, what);
    if (status == KEMPE_FMU_OK)
        status = kempe_fmu_refresh(fmu);
    if (status == KEMPE_FMU_OK && count)
        memcpy(to, values_of(fmu, block), count * sizeof(double));
    return status;
}

kempe_fmu_status kempe_fmu_get_states(kempe_fmu *fmu, double *x, size_t count)
{
    return give(fmu, KEMPE_FMU_STATES, x, count, "continuous states");
}

kempe_fmu_status kempe_fmu_get_rates(kempe_fmu *fmu, double *dx, size_t count)
{
    return give(fmu, KEMPE_FMU_RATES, dx, count, "derivatives of states");
}

int kempe_fmu_indicators(const kempe_fmu *fmu)
{
    const kempe_equations *e = fmu->model->equations;
    int count = 0;
    for (int i = 0; i < e->conditions; i++)
        count += KEMPE_CONDITION_IS_EVENT(e->condition_kind[i]);
    return count;
}

kempe_fmu_status kempe_fmu_get_indicators(kempe_fmu *fmu, double *value, size_t count)
{
    const kempe_equations *e = fmu->model->equations;
    kempe_fmu_status status = check_count(fmu, value, count, kempe_fmu_indicators(fmu), "event indicators");
    if (status == KEMPE_FMU_OK)
        status = kempe_fmu_refresh(fmu);
    if (status != KEMPE_FMU_OK)
        return status;
    const double *all = values_of(fmu, KEMPE_FMU_CONDITIONS);
    for (int i = 0; i < e->conditions; i++)
        if (KEMPE_CONDITION_IS_EVENT(e->condition_kind[i]))
            *value++ = all[i];
    return KEMPE_FMU_OK;
}

kempe_fmu_status kempe_fmu_get_nominals(kempe_fmu *fmu, double *nominal, size_t count)
{
    const kempe_equations *e = fmu->model->equations;
    kempe_fmu_status status = check_count(fmu, nominal, count, 2 * e->freedom, "continuous states");
    if (status == KEMPE_FMU_OK)
        status = kempe_fmu_refresh(fmu);
    if (status != KEMPE_FMU_OK)
        return status;
    kempe_simulator_get_choice(&fmu->simulator, fmu->part.choice);
    for (int i = 0; i < e->freedom; i++)
        nominal[i] = nominal[e->freedom + i] = e->scale[fmu->part.choice[i]];
    return KEMPE_FMU_OK;
}

/* Sentences on what an event changed. */
static void report_events(kempe_fmu *fmu, int exchanged)
{
    const kempe_equations *e = fmu->model->equations;
    const kempe_simulator *s = &fmu->simulator;
    for (int i = 0; i < e->conditions; i++)
        if (e->condition_kind[i] <= KEMPE_CONDITION_ENDS && (s->part.modes[i] > 0.5) != (fmu->part.held[i] > 0.5))
            (void)kempe_fmu_say(fmu, KEMPE_FMU_OK, KEMPE_FMU_LOG_EVENTS, "The condition '%s' %s at t = %.9g s.",
                                e->condition_names[i], s->part.modes[i] > 0.5 ? "holds" : "ends", s->t);
    for (int i = 0; e->friction && i < e->friction->elements; i++) {
        const int slot = e->friction->slot[i]; /* its second number is 1 where it is held; the name of the third */
        if ((s->part.modes[slot + 1] > 0.5) != (fmu->part.held[slot + 1] > 0.5))
            (void)kempe_fmu_say(fmu, KEMPE_FMU_OK, KEMPE_FMU_LOG_EVENTS, "The %s %s at t = %.9g s.",
                                e->condition_names[slot + 2], s->part.modes[slot + 1] > 0.5 ? "sticks" : "slips", s->t);
    }
    kempe_simulator_get_choice(s, fmu->part.choice);
    for (int i = 0; i < e->freedom && exchanged; i++)
        (void)kempe_fmu_say(fmu, KEMPE_FMU_OK, KEMPE_FMU_LOG_EVENTS,
                            "The states x[%d] and x[%d] belong to the coordinate '%s' from t = %.9g s on.", i + 1,
                            e->freedom + i + 1, e->coordinate_names[fmu->part.choice[i]], s->t);
}

kempe_fmu_status kempe_fmu_update(kempe_fmu *fmu, int *changed, int *exchanged, int *ended, double *next)
{
    kempe_simulator *s = &fmu->simulator;
    kempe_fmu_status status = kempe_fmu_refresh(fmu);
    const double exchanges = s->work.exchanges;
    *changed = *exchanged = *ended = 0;
    *next = kempe_simulator_next_time(s);
    if (status != KEMPE_FMU_OK)
        return status;
    if (fmu->model->equations->conditions)
        memcpy(fmu->part.held, s->part.modes, (size_t)fmu->model->equations->conditions * sizeof(double));
    kempe_simulator_status result = kempe_simulator_update(s, changed);
    if (result == KEMPE_SIMULATOR_FAILED)
        return FAIL("%s", s->message);
    *exchanged = s->work.exchanges > exchanges;
    if (result == KEMPE_SIMULATOR_ENDED) {
        fmu->now.ended = 1;
        (void)kempe_fmu_say(fmu, KEMPE_FMU_WARNING, KEMPE_FMU_LOG_WARNING, "%s", s->message);
    }
    *ended = fmu->now.ended;
    *next = kempe_simulator_next_time(s);
    fmu->now.event = 0;
    kempe_simulator_get_states(s, fmu->part.x);
    report_events(fmu, *exchanged);
    return KEMPE_FMU_OK;
}

kempe_fmu_status kempe_fmu_completed_step(kempe_fmu *fmu, int *wants_event, int *ended)
{
    kempe_fmu_status status = kempe_fmu_refresh(fmu);
    if (status == KEMPE_FMU_OK)
        kempe_simulator_report(&fmu->simulator);
    if (status == KEMPE_FMU_OK && fmu->simulator.message[0])
        (void)kempe_fmu_say(fmu, KEMPE_FMU_WARNING, KEMPE_FMU_LOG_WARNING, "%s", fmu->simulator.message);
    *wants_event = status == KEMPE_FMU_OK && kempe_simulator_wants_update(&fmu->simulator);
    *ended = fmu->now.ended;
    return status;
}

/* -- co-simulation: the unit integrates ------------------------------------------------------------------ */

/* A step of the integrator at a time. The simulator changes its conditions at the beginning of the step after an event:
 * where it does so later than at the beginning, the event is at that time, and the step is undone. */
static kempe_simulator_status step_by_step(kempe_fmu *fmu, double until, kempe_fmu_stride *stride)
{
    kempe_simulator *s = &fmu->simulator;
    kempe_simulator_status status = KEMPE_SIMULATOR_GOES;
    const double from = s->t;
    double back = until;
    while (status == KEMPE_SIMULATOR_GOES && s->t < back) {
        const double events = s->work.events, begin = s->t;
        kempe_simulator_save(s, fmu->part.kept);
        status = kempe_simulator_step(s);
        if (status == KEMPE_SIMULATOR_FAILED || s->t > back) {
            kempe_simulator_restore(s, fmu->part.kept);
            status = kempe_simulator_advance(s, back);
        }
        if (stride->stops_at_events && s->work.events > events && begin > from) {
            kempe_simulator_restore(s, fmu->part.kept);
            stride->event = fmu->now.event = 1;
            status = KEMPE_SIMULATOR_GOES;
            break;
        }
        if (status == KEMPE_SIMULATOR_GOES && stride->observer) {
            double wanted = until;
            const int mode = fmu->now.mode;
            fmu->now.mode = KEMPE_FMU_INTERMEDIATE;
            const int early = stride->observer(fmu, s->t, &wanted);
            fmu->now.mode = mode;
            if (early && wanted < back)
                back = wanted > s->t ? wanted : s->t;
        }
    }
    stride->early = s->t < until;
    return status;
}

kempe_fmu_status kempe_fmu_do_step(kempe_fmu *fmu, double from, double step, kempe_fmu_stride *stride)
{
    kempe_simulator *s = &fmu->simulator;
    const double near = KMP_SAME_COMMUNICATION * (1 + fabs(s->t));
    const double events = s->work.events, exchanges = s->work.exchanges, began = s->t;
    double until = from + step;
    stride->reached = s->t;
    stride->event = stride->early = stride->ended = 0;
    if (!(fabs(from - s->t) <= near))
        return FAIL("The communication step begins at %.17g s, but the unit is at %.17g s.", from, s->t);
    if (!(step > 0) || !isfinite(step))
        return FAIL("The communication step of %g s is not positive and finite.", step);
    if (until > fmu->now.stop + near)
        return FAIL("The communication step ends at %.9g s, which is after the stop time %.9g s.", until,
                    fmu->now.stop);
    if (until > fmu->now.stop)
        until = fmu->now.stop;
    kempe_fmu_status refreshed = kempe_fmu_refresh(fmu);
    if (refreshed != KEMPE_FMU_OK)
        return refreshed;
    if (fmu->now.ended) {
        stride->ended = 1;
        return DISCARD("The motion has ended at t = %.9g s.", s->t);
    }
    const kempe_simulator_status status = stride->stops_at_events || stride->observer
                                              ? step_by_step(fmu, until, stride)
                                              : kempe_simulator_advance(s, until);
    stride->reached = fmu->now.t = s->t;
    (void)kempe_fmu_say(fmu, KEMPE_FMU_OK, KEMPE_FMU_LOG_STEPS,
                        "The communication step ends at t = %.9g s, after %.0f steps and %.0f evaluations in all.",
                        s->t, s->work.steps, s->work.evaluations);
    if (s->work.events > events || s->work.exchanges > exchanges)
        (void)kempe_fmu_say(fmu, KEMPE_FMU_OK, KEMPE_FMU_LOG_EVENTS,
                            "Between t = %.9g s and t = %.9g s were %.0f events and %.0f changes of states.", began,
                            s->t, s->work.events - events, s->work.exchanges - exchanges);
    if (status == KEMPE_SIMULATOR_FAILED)
        return DISCARD("%s", s->message);
    if (status == KEMPE_SIMULATOR_ENDED)
        stride->ended = fmu->now.ended = 1;
    if (s->message[0]) /* the end, or what makes the motion not trustworthy */
        (void)kempe_fmu_say(fmu, KEMPE_FMU_WARNING, KEMPE_FMU_LOG_WARNING, "%s", s->message);
    return KEMPE_FMU_OK;
}
