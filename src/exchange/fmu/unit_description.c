/* SPDX-License-Identifier: BSD-3-Clause */
/* modelDescription.xml and terminalsAndIcons.xml. The order of variables and their value references are the same
 * as in kempe_fmu.h. Dependencies are by the arguments that the generated routines read: coordinates follow from the
 * states through the closures, accelerations and multipliers from all that the routines of the motion read. */
#include "exchange/fmu/unit_description.h"
#include "exchange/fmu/unit_files.h"
#include "exchange/simulator/kempe_fmu.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include "model/read/loads.h"
#include <ctype.h>
#include <string.h>

/* -- dependencies ---------------------------------------------------------------------------------------- */

/* Level of a computed value: the deeper ones depend on more. */
typedef enum level { CONSTANT, PLACE, RATE, ACCELERATION } level;

typedef struct structure {
    const kmp_code_source *source;
    int inputs;        /* three each */
    bool *by_level[4]; /* inputs that the coordinates, rates, accelerations depend on */
    bool *read;        /* by the value at hand: inputs */
    bool *marked;      /* values of a program */
    const kmp_code_routine *show, *changes;
} structure;

/* Marks the inputs that the outputs [first, first + count) of stage 1 are computed from, and returns their level. */
static level read_outputs(const structure *s, const kmp_code_routine *r, int first, int count, bool *inputs)
{
    const kmp_program *p = r->program;
    /* Conditions are decided by place and rate, or by more: see below. */
    static const level levels[KMP_IN_COUNT] = {[KMP_IN_Q] = PLACE,
                                               [KMP_IN_QD] = RATE,
                                               [KMP_IN_MODE] = RATE,
                                               [KMP_IN_QDD] = ACCELERATION,
                                               [KMP_IN_LAMBDA] = ACCELERATION};
    const int before = p->constant_count + p->input_count, all = before + p->code[p->stages];
    level deepest = CONSTANT;
    memset(s->marked, 0, (size_t)all * sizeof *s->marked);
    for (int k = 0; k < count; k++)
        s->marked[p->output[p->outputs[1] + first + k] >> 1] = true;
    for (int i = p->code[p->stages] - 1; i >= 0; i--)
        for (int k = 0; s->marked[before + i] && k < kmp_op_arity((kmp_op)p->instruction[i].op); k++)
            s->marked[kmp_instruction_operand(&p->instruction[i], k) >> 1] = true;
    for (int k = 0; k < p->input_count; k++) {
        const kmp_program_input *in = &p->input[k];
        if (!s->marked[p->constant_count + k])
            continue;
        deepest = levels[in->kind] > deepest ? levels[in->kind] : deepest;
        if (in->kind == KMP_IN_TIME && in->index > 0 && (int)in->index <= s->inputs)
            inputs[in->index - 1] = true;
    }
    return deepest;
}

static int size_of(const kmp_code_routine *r)
{
    const kmp_program *p = r->program;
    return p->constant_count + p->input_count + p->code[p->stages];
}

/* Inputs of coordinates: the values that closures read; of rates: the derivatives, too; of accelerations: all. */
static void find_levels(structure *s)
{
    static const char *const deep[] = {"motion", "loads", "changes"};
    const kmp_code_routine *closures = kmp_simulated_routine(s->source, "closures");
    bool *place = s->by_level[PLACE], *rate = s->by_level[RATE], *acceleration = s->by_level[ACCELERATION];
    if (closures)
        (void)read_outputs(s, closures, 0, closures->program->outputs[2] - closures->program->outputs[1], rate);
    for (int k = 0; k < s->inputs; k += 3) {
        place[k] = rate[k] = rate[k] || rate[k + 1]; /* h has the value, h_t its derivative */
        acceleration[k] = acceleration[k + 1] = acceleration[k + 2] = rate[k];
    }
    for (int k = 0; k < s->inputs; k++)
        acceleration[k] = acceleration[k] || rate[k];
    for (size_t i = 0; i < sizeof deep / sizeof *deep; i++) {
        const kmp_code_routine *r = kmp_simulated_routine(s->source, deep[i]);
        if (r)
            (void)read_outputs(s, r, 0, r->program->outputs[2] - r->program->outputs[1], acceleration);
    }
}

/* Dependencies of computed variables of a unit of sources; NULL: no memory. */
static structure *find_structure(kmp_arena *arena, const kmp_code_source *source)
{
    structure *s = KMP_ARENA_NEW(arena, structure, 1);
    int most = 1;
    for (int k = 0; k < source->count; k++)
        most = size_of(&source->routines[k]) > most ? size_of(&source->routines[k]) : most;
    if (!s)
        return NULL;
    s->source = source;
    s->inputs = 3 * source->input_count;
    s->show = kmp_simulated_routine(source, "show");
    s->changes = kmp_simulated_routine(source, "changes");
    if (!KMP_ARENA_MAKE(arena,
                        KMP_ROOM(bool, s->inputs, &s->by_level[CONSTANT], &s->by_level[PLACE], &s->by_level[RATE],
                                 &s->by_level[ACCELERATION], &s->read),
                        KMP_ROOM(bool, most, &s->marked)))
        return NULL;
    find_levels(s);
    return s;
}

/* The level of a variable; the inputs that its own expression reads are marked. */
static level find_level(const structure *s, int block, int at)
{
    const int f = s->source->simulated->freedom;
    switch (block) {
    case KEMPE_FMU_Q:
        return PLACE;
    case KEMPE_FMU_QD:
        return RATE;
    case KEMPE_FMU_STATES:
        return at < f ? PLACE : RATE;
    case KEMPE_FMU_RATES:
        return at < f ? RATE : ACCELERATION;
    case KEMPE_FMU_OUTPUTS:
        return s->show ? read_outputs(s, s->show, at, 1, s->read) : ACCELERATION;
    case KEMPE_FMU_CONDITIONS:
        return read_outputs(s, s->changes, at, 1, s->read);
    default:
        return ACCELERATION;
    }
}

/* True where the computed variable may depend on a known one, a state or an input. */
static bool depends(const structure *s, unsigned reference, unsigned known)
{
    const int block = (int)(reference / KEMPE_FMU_BLOCK), at = (int)(reference % KEMPE_FMU_BLOCK);
    const int known_block = (int)(known / KEMPE_FMU_BLOCK), known_at = (int)(known % KEMPE_FMU_BLOCK);
    memset(s->read, 0, (size_t)s->inputs * sizeof *s->read);
    const level deepest = find_level(s, block, at);
    if (known_block == KEMPE_FMU_STATES && block == KEMPE_FMU_RATES && at < s->source->simulated->freedom)
        return known_at == at + s->source->simulated->freedom;
    if (known_block == KEMPE_FMU_STATES)
        return deepest >= RATE || (deepest == PLACE && known_at < s->source->simulated->freedom);
    if (block == KEMPE_FMU_RATES && at < s->source->simulated->freedom)
        return false;
    return s->read[known_at] || s->by_level[deepest][known_at];
}

/* A variable as modelDescription.xml has it. */
typedef struct variable {
    const char *name, *description;
    unsigned reference;
    const char *causality, *variability, *initial; /* initial NULL: none */
    bool whole, has_start;                         /* an integer */
    double start;
    int unit;       /* 1 + its place in the units; 0: none */
    unsigned state; /* of a derivative: the reference of its state; 0: none */
} variable;

/* -- units ------------------------------------------------------------------------------------------- */

enum { MOST_UNITS = 64 };

/* Another unit of the same dimension: a value in it is `factor` times that in SI. */
typedef struct display {
    const char *unit, *name;
    double factor;
    bool first; /* is shown */
} display;

static const display displays[] = {{"rad", "deg", 57.29577951308232, true},
                                   {"rad/s", "rpm", 9.549296585513721, true},
                                   {"rad/s", "deg/s", 57.29577951308232, false},
                                   {"rad/s^2", "deg/s^2", 57.29577951308232, true},
                                   {"m", "mm", 1000, false},
                                   {"m/s", "mm/s", 1000, false}};

typedef struct unit {
    const char *name;
    int power[3], angle; /* of m, kg, s, rad */
} unit;

typedef struct description {
    const kmp_unit_plan *plan;
    const kmp_code_source *source;
    kmp_arena arena;
    variable *variable;
    int count, room;
    unit units[MOST_UNITS];
    int unit_count;
    const structure *structure; /* NULL: dependencies are unknown */
} description;

static const char *name_unit(kmp_arena *arena, const kmp_dimension *d, int angle)
{
    static const char *const angles[] = {"rad", "rad/s", "rad/s^2"}, *const lengths[] = {"m", "m/s", "m/s^2"};
    const double *p = d->power;
    kmp_text text = {0};
    if (p[1] == 0 && p[0] == (angle == 0) && p[2] <= 0 && p[2] >= -2 && (angle == 0 || angle == 1))
        return (angle ? angles : lengths)[(int)-p[2]];
    kmp_dimension_print(&text, *d);
    return kmp_text_keep(&text, arena);
}

/* 1 + the place of a unit; 0: a plain number, an unknown dimension, or broken powers, which the FMI lacks. */
static int take_unit(description *d, kmp_dimension dimension, int angle)
{
    unit u = {.angle = angle};
    if (dimension.kind != KMP_DIMENSION_KNOWN || d->unit_count == MOST_UNITS)
        return 0;
    for (int k = 0; k < 3; k++) {
        u.power[k] = (int)dimension.power[k];
        if (dimension.power[k] != u.power[k])
            return 0;
    }
    if (!u.power[0] && !u.power[1] && !u.power[2] && !angle)
        return 0;
    u.name = name_unit(&d->arena, &dimension, angle);
    for (int k = 0; u.name && k < d->unit_count; k++)
        if (strcmp(d->units[k].name, u.name) == 0)
            return k + 1;
    if (!u.name)
        return 0;
    d->units[d->unit_count++] = u;
    return d->unit_count;
}

/* -- names ------------------------------------------------------------------------------------------- */

/* A part of a name in quotes: characters that the convention lacks are written as numbers. */
static void put_quoted(kmp_text *text, const char *s, size_t length)
{
    kmp_text_put(text, "'");
    for (size_t k = 0; k < length; k++) {
        unsigned char c = (unsigned char)s[k];
        if (c < 128 && (isalnum(c) || strchr("_!#$%&()*+,-./:;<>=?@[]^{}|~ ", c)))
            kmp_text_append(text, s + k, 1);
        else
            kmp_text_printf(text, "_%02x", c);
    }
    kmp_text_put(text, "'");
}

/* A name of the naming convention `structured`: parts with points between, numbers as indices, `c.1.2` as c[1,2]. */
static void put_structured(kmp_text *text, const char *name)
{
    static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_0123456789";
    const char *const digits = letters + sizeof letters - 11;
    bool index = false; /* within brackets */
    for (bool first = true;; first = false) {
        const size_t length = strcspn(name, "."), number = strspn(name, digits);
        if (!first && length > 0 && number == length) {
            kmp_text_printf(text, "%s%.*s", index ? "," : "[", (int)length, name);
            index = true;
        } else {
            kmp_text_put(text, index ? "]" : "");
            index = false;
            kmp_text_put(text, first ? "" : ".");
            if (length > 0 && number == 0 && strspn(name, letters) == length)
                kmp_text_append(text, name, length);
            else
                put_quoted(text, name, length);
        }
        if (!name[length]) {
            kmp_text_put(text, index ? "]" : "");
            return;
        }
        name += length + 1;
    }
}

/* "q." and a name of the model, as a name of the convention that no other variable has. */
static const char *name_of(description *d, const char *prefix, const char *name, const char *ending)
{
    kmp_text text = {0};
    kmp_text_put(&text, prefix);
    put_structured(&text, name);
    kmp_text_put(&text, ending);
    for (int k = 0; text.s && !text.failed && k < d->count; k++)
        if (strcmp(d->variable[k].name, text.s) == 0) {
            kmp_text_put(&text, "_");
            k = -1; /* from the first one on */
        }
    return kmp_text_keep(&text, &d->arena);
}

/* -- variables --------------------------------------------------------------------------------------- */

static void add(description *d, variable v)
{
    if (d->count < d->room && v.name)
        d->variable[d->count++] = v;
    else
        d->arena.failed = true;
}

static unsigned reference(int block, int k)
{
    return (unsigned)(block * KEMPE_FMU_BLOCK + k);
}

/* A variable that is computed. */
static variable computed(int block, int k, const char *causality, const char *name, const char *text)
{
    return (variable){.name = name,
                      .description = text,
                      .reference = reference(block, k),
                      .causality = causality,
                      .variability = "continuous",
                      .initial = "calculated"};
}

static variable given(int block, int k, const char *causality, const char *variability, const char *name,
                      const char *text, double start)
{
    return (variable){.name = name,
                      .description = text,
                      .reference = reference(block, k),
                      .causality = causality,
                      .variability = variability,
                      .initial = strcmp(causality, "input") == 0 ? NULL : "exact",
                      .has_start = true,
                      .start = start};
}

/* An input has the derivatives that the equations read. */
static void add_inputs(description *d)
{
    static const char *const endings[] = {"", ".d", ".dd"};
    static const char *const texts[] = {"input of the model", "its first derivative, which the equations read",
                                        "its second derivative, which closures read"};
    const kempe_model *model = d->source->model;
    for (int k = 0; k < d->source->input_count; k++) {
        kmp_unit written;
        const kmp_model_input *input = &model->inputs[k];
        int angle = input->unit && kmp_unit_read(input->unit, strlen(input->unit), &written) ? written.angle : 0;
        kmp_dimension dimension = input->dimension;
        const int orders = kmp_model_moved_by(model, k) ? 3 : 1 + d->source->input_order[k];
        for (int i = 0; i < orders; i++, dimension.power[2] -= 1) {
            variable v = given(KEMPE_FMU_INPUTS, 3 * k + i, "input", "continuous",
                               name_of(d, "", d->source->input_names[k], endings[i]), texts[i],
                               d->source->simulated->inputs[3 * k + i]);
            v.unit = take_unit(d, dimension, angle);
            add(d, v);
        }
    }
}

static void add_outputs(description *d)
{
    const kempe_model *model = d->source->model;
    kmp_unit written;
    int place = 0;
    for (int o = 0; o < model->output_count; o++)
        for (int k = 0; k < kmp_output_width(model, &model->outputs[o]); k++, place++) {
            variable v = computed(KEMPE_FMU_OUTPUTS, place, "output",
                                  name_of(d, "", d->source->output_names[place], ""), "output of the model");
            const char *in = kmp_output_unit(model, &model->outputs[o], k);
            if (in && *in && kmp_unit_read(in, strlen(in), &written))
                v.unit = take_unit(d, written.dimension, written.angle);
            add(d, v);
        }
}

/* The unit of a coordinate, or of a derivative of it. */
static int coordinate_unit(description *d, int k, int order)
{
    static const double lengths[] = {1, 0};
    const int kind = d->source->simulated->coordinate_kind[k];
    if (kind == KEMPE_COORDINATE_STATE)
        return 0;
    kmp_dimension dimension = KMP_DIM(lengths[kind == KEMPE_COORDINATE_ROTATION], 0, -order);
    return take_unit(d, dimension, kind == KEMPE_COORDINATE_ROTATION);
}

static void add_coordinates(description *d)
{
    static const char *const prefixes[] = {"q.", "qd.", "qdd."};
    static const char *const texts[] = {"coordinate; its start value is where the loops are closed nearby",
                                        "rate of a coordinate", "acceleration of a coordinate"};
    const struct kmp_simulated *x = d->source->simulated;
    for (int order = 0; order < 3; order++)
        for (int k = 0; k < d->source->n; k++) {
            variable v = computed(KEMPE_FMU_Q + order, k, order < 2 ? "output" : "local",
                                  name_of(d, prefixes[order], d->source->coordinate_names[k], ""), texts[order]);
            if (order < 2) {
                v.initial = "approx";
                v.has_start = true;
                v.start = (order ? x->qd : x->q)[k];
            }
            v.unit = coordinate_unit(d, k, order);
            add(d, v);
        }
    for (int r = 0; r < d->source->m; r++)
        add(d, computed(KEMPE_FMU_LAMBDA, r, "local", name_of(d, "lambda.", d->source->row_names[r], ""),
                        "Lagrange multiplier of a row of the closures"));
}

static void add_states(description *d)
{
    const struct kmp_simulated *x = d->source->simulated;
    const int f = x->freedom;
    bool same = f > 0; /* all coordinates have one unit: states too */
    for (int k = 1; k < d->source->n; k++)
        same = same && x->coordinate_kind[k] == x->coordinate_kind[0];
    for (int derivative = 0; derivative < 2; derivative++)
        for (int k = 0; k < 2 * f; k++) {
            const char *name = kmp_arena_printf(&d->arena, derivative ? "der(x[%d])" : "x[%d]", k + 1);
            const char *text = derivative ? "derivative of a state"
                               : k < f    ? "independent coordinate: see choice"
                                          : "rate of an independent coordinate";
            variable v = computed(derivative ? KEMPE_FMU_RATES : KEMPE_FMU_STATES, k, "local", name, text);
            v.state = derivative ? reference(KEMPE_FMU_STATES, k) : 0;
            v.unit = same ? coordinate_unit(d, 0, derivative + (k >= f)) : 0;
            add(d, v);
        }
    for (int k = 0; k < f; k++) {
        variable v = computed(KEMPE_FMU_CHOICE, k, "output", kmp_arena_printf(&d->arena, "choice[%d]", k + 1),
                              "number of the coordinate that a state belongs to, from 1, in the order of q");
        v.whole = true;
        v.variability = "discrete";
        add(d, v);
    }
}

/* A variable of the integrator of the unit. */
typedef struct solver_variable {
    const char *name, *text;
} solver_variable;

static void add_work(description *d)
{
    static const solver_variable work[KEMPE_FMU_WORK_COUNT] = {
        {"solver.exchanges", "changes of independent coordinates so far"},
        {"solver.events", "changes of conditions so far"},
        {"solver.steps", "steps of the integrator of co-simulation so far"},
        {"solver.evaluations", "evaluations of the equations so far"}};
    for (int k = 0; k < KEMPE_FMU_WORK_COUNT; k++) {
        variable v = computed(KEMPE_FMU_WORK, k, k == 0 ? "output" : "local", work[k].name, work[k].text);
        v.whole = true;
        v.variability = "discrete";
        add(d, v);
    }
}

static void add_settings(description *d)
{
    static const solver_variable settings[KEMPE_FMU_SETTINGS_COUNT] = {
        {"solver.rtol", "relative tolerance of co-simulation"},
        {"solver.atol", "absolute tolerance of co-simulation, times the size of a coordinate"},
        {"solver.fixed_step", "length of all steps; 0: by the estimated error"},
        {"solver.longest_step", "length of the longest step; 0: any"}};
    const double start[KEMPE_FMU_SETTINGS_COUNT] = {kmp_unit_rtol(d->source->model), kmp_unit_atol(d->source->model), 0,
                                                    kmp_unit_longest_step(d->source->model)};
    for (int k = 0; d->plan->simulation && k < KEMPE_FMU_SETTINGS_COUNT; k++) {
        variable v = given(KEMPE_FMU_SETTINGS, k, "parameter", "fixed", settings[k].name, settings[k].text, start[k]);
        v.unit = k > 1 ? take_unit(d, KMP_DIM_TIME, 0) : 0;
        add(d, v);
    }
}

static void add_parameters(description *d)
{
    const struct kmp_simulated *x = d->source->simulated;
    for (int k = 0; k < d->source->parameter_count; k++) {
        variable v = given(KEMPE_FMU_PARAMETERS, k, "parameter", x->fixed[k] ? "fixed" : "tunable",
                           name_of(d, "", d->source->parameter_name[k], ""),
                           x->fixed[k] ? "parameter of the model; the loops depend on it" : "parameter of the model",
                           d->source->value[k]);
        if (x->symbol[k] < d->source->model->parameter_count)
            v.unit = take_unit(d, d->source->model->parameters[x->symbol[k]].dimension, 0);
        add(d, v);
    }
}

static void add_conditions(description *d)
{
    const struct kmp_simulated *x = d->source->simulated;
    for (int k = 0, number = 1; k < x->condition_count; k++)
        if (KEMPE_CONDITION_IS_EVENT(x->condition_kind[k]))
            add(d, computed(KEMPE_FMU_CONDITIONS, k, "local", kmp_arena_printf(&d->arena, "condition[%d]", number++),
                            kmp_arena_printf(&d->arena, "an event is its change of sign: %s", x->condition_name[k])));
}

static bool list_variables(description *d)
{
    const struct kmp_simulated *x = d->source->simulated;
    d->room = 1 + 3 * d->source->input_count + d->source->output_count + 3 * d->source->n + d->source->m +
              5 * x->freedom + KEMPE_FMU_WORK_COUNT + KEMPE_FMU_SETTINGS_COUNT + d->source->parameter_count +
              x->condition_count;
    d->variable = KMP_ARENA_NEW(&d->arena, variable, d->room);
    if (!d->variable)
        return false;
    add(d, (variable){.name = "time",
                      .description = "time",
                      .causality = "independent",
                      .variability = "continuous",
                      .unit = take_unit(d, KMP_DIM_TIME, 0)});
    add_inputs(d);
    add_outputs(d);
    add_coordinates(d);
    add_states(d);
    add_work(d);
    add_settings(d);
    add_parameters(d);
    add_conditions(d);
    return !d->arena.failed;
}

/* -- text -------------------------------------------------------------------------------------------- */

/* An attribute whose value is escaped. */
static void put_attribute(kmp_text *xml, const char *name, const char *value)
{
    kmp_text_printf(xml, " %s=\"", name);
    for (; value && *value; value++)
        if (*value == '"')
            kmp_text_put(xml, "&quot;");
        else if (*value == '\n')
            kmp_text_put(xml, " ");
        else
            kmp_text_escape(xml, (const char[]){*value, 0});
    kmp_text_put(xml, "\"");
}

static void put_number(kmp_text *xml, const char *name, double x)
{
    kmp_text_printf(xml, " %s=\"", name);
    kmp_text_number(xml, x);
    kmp_text_put(xml, "\"");
}

static void put_flags(kmp_text *xml, const char *const *flags)
{
    for (; *flags; flags++)
        kmp_text_printf(xml, "\n      %s=\"true\"", *flags);
}

/* The past of delayed signals has no constant length: such a unit on the library saves no states. */
static void put_kind(kmp_text *xml, const kmp_unit_plan *plan, bool exchange)
{
    static const char *const states[][3] = {{"canGetAndSetFMUstate", "canSerializeFMUstate", NULL},
                                            {"canGetAndSetFMUState", "canSerializeFMUState", NULL}};
    static const char *const derivatives[][3] = {
        {"providesDirectionalDerivative", NULL},
        {"providesDirectionalDerivatives", "providesAdjointDerivatives", NULL}};
    static const char *const steps[][5] = {{NULL},
                                           {"providesIntermediateUpdate", "mightReturnEarlyFromDoStep",
                                            "canReturnEarlyAfterIntermediateUpdate", "hasEventMode", NULL}};
    static const char *const any_step[] = {"canHandleVariableCommunicationStepSize", NULL};
    const char *name = exchange ? "ModelExchange" : "CoSimulation";
    kmp_text_printf(xml, "  <%s", name);
    put_attribute(xml, "modelIdentifier", plan->source->name);
    if (!plan->on_library || plan->source->model->delay_count == 0)
        put_flags(xml, states[plan->fmi == 3]);
    if (!plan->on_library)
        put_flags(xml, derivatives[plan->fmi == 3]);
    if (exchange && plan->fmi == 3)
        kmp_text_put(xml, "\n      needsCompletedIntegratorStep=\"true\"");
    if (!exchange)
        put_flags(xml, any_step);
    if (!exchange && !plan->on_library) {
        put_flags(xml, steps[plan->fmi == 3]);
        kmp_text_put(xml, "\n      maxOutputDerivativeOrder=\"1\"");
    }
    if (plan->fmi == 3 || plan->on_library) {
        kmp_text_put(xml, "/>\n");
        return;
    }
    kmp_text_put(xml, ">\n    <SourceFiles>\n");
    for (int k = 0; k < plan->source_count; k++) {
        kmp_text_put(xml, "      <File");
        put_attribute(xml, "name", plan->sources[k]);
        kmp_text_put(xml, "/>\n");
    }
    kmp_text_printf(xml, "    </SourceFiles>\n  </%s>\n", name);
}

static void put_units(kmp_text *xml, const description *d)
{
    static const char *const bases[] = {"m", "kg", "s"};
    kmp_text_put(xml, "  <UnitDefinitions>\n");
    for (int k = 0; k < d->unit_count; k++) {
        const unit *u = &d->units[k];
        kmp_text_put(xml, "    <Unit");
        put_attribute(xml, "name", u->name);
        kmp_text_put(xml, "><BaseUnit");
        for (int i = 0; i < 3; i++)
            if (u->power[i])
                kmp_text_printf(xml, " %s=\"%d\"", bases[i], u->power[i]);
        if (u->angle)
            kmp_text_printf(xml, " rad=\"%d\"", u->angle);
        kmp_text_put(xml, "/>");
        for (size_t i = 0; i < sizeof displays / sizeof *displays; i++)
            if (strcmp(displays[i].unit, u->name) == 0) {
                kmp_text_put(xml, "<DisplayUnit");
                put_attribute(xml, "name", displays[i].name);
                put_number(xml, "factor", displays[i].factor);
                kmp_text_put(xml, "/>");
            }
        kmp_text_put(xml, "</Unit>\n");
    }
    kmp_text_put(xml, "  </UnitDefinitions>\n");
}

static void put_categories(kmp_text *xml)
{
    static const char *const texts[][2] = {{"logEvents", "events and changes of states"},
                                           {"logStatusWarning", "warnings"},
                                           {"logStatusDiscard", "steps that cannot be made as requested"},
                                           {"logStatusError", "errors"},
                                           {"logSteps", "steps of the integrator"},
                                           {"logAll", "all messages"}};
    kmp_text_put(xml, "  <LogCategories>\n");
    for (size_t k = 0; k < sizeof texts / sizeof *texts; k++)
        kmp_text_printf(xml, "    <Category name=\"%s\" description=\"%s\"/>\n", texts[k][0], texts[k][1]);
    kmp_text_put(xml, "  </LogCategories>\n");
}

static void put_experiment(kmp_text *xml, const kempe_model *model)
{
    const kmp_run_settings *run = &model->run;
    kmp_text_put(xml, "  <DefaultExperiment startTime=\"0\"");
    if (run->t_end > 0)
        put_number(xml, "stopTime", run->t_end);
    put_number(xml, "tolerance", kmp_unit_rtol(model));
    if (run->output_step > 0)
        put_number(xml, "stepSize", run->output_step);
    kmp_text_put(xml, "/>\n");
}

/* Causality, variability and initial value, the same in both versions. */
static void put_roles(kmp_text *xml, const variable *v)
{
    put_attribute(xml, "name", v->name);
    kmp_text_printf(xml, " valueReference=\"%u\"", v->reference);
    kmp_text_printf(xml, " causality=\"%s\" variability=\"%s\"", v->causality, v->variability);
    if (v->initial)
        kmp_text_printf(xml, " initial=\"%s\"", v->initial);
    put_attribute(xml, "description", v->description);
}

static void put_value(kmp_text *xml, const description *d, const variable *v)
{
    if (v->unit && !v->whole) {
        const char *name = d->units[v->unit - 1].name;
        put_attribute(xml, "unit", name);
        for (size_t k = 0; k < sizeof displays / sizeof *displays; k++)
            if (displays[k].first && strcmp(displays[k].unit, name) == 0)
                put_attribute(xml, "displayUnit", displays[k].name);
    }
    if (v->has_start)
        put_number(xml, "start", v->start);
    unsigned index = 1; /* in version 2 */
    while (v->state && d->variable[index - 1].reference != v->state)
        index++;
    if (v->state)
        kmp_text_printf(xml, " derivative=\"%u\"", d->plan->fmi == 2 ? index : v->state);
}

static void put_variables(kmp_text *xml, const description *d)
{
    kmp_text_put(xml, "  <ModelVariables>\n");
    for (int k = 0; k < d->count; k++) {
        const variable *v = &d->variable[k];
        if (d->plan->fmi == 2) {
            kmp_text_put(xml, "    <ScalarVariable");
            put_roles(xml, v);
            kmp_text_printf(xml, "><%s", v->whole ? "Integer" : "Real");
            put_value(xml, d, v);
            kmp_text_put(xml, "/></ScalarVariable>\n");
        } else {
            kmp_text_printf(xml, "    <%s", v->whole ? "Int32" : "Float64");
            put_roles(xml, v);
            put_value(xml, d, v);
            kmp_text_put(xml, "/>\n");
        }
    }
    kmp_text_put(xml, "  </ModelVariables>\n");
}

static void put_dependencies(kmp_text *xml, const description *d, unsigned reference)
{
    const char *between = "";
    kmp_text_put(xml, " dependencies=\"");
    for (int k = 0; k < d->count; k++) {
        const unsigned known = d->variable[k].reference, block = known / KEMPE_FMU_BLOCK;
        if ((block != KEMPE_FMU_STATES && block != KEMPE_FMU_INPUTS) || !depends(d->structure, reference, known))
            continue;
        kmp_text_printf(xml, "%s%u", between, d->plan->fmi == 2 ? (unsigned)k + 1 : known);
        between = " ";
    }
    kmp_text_put(xml, "\"");
}

/* An entry of the model structure: by index in version 2, by reference in version 3. */
static void put_entry(kmp_text *xml, const description *d, const char *element, int k, bool initial)
{
    const variable *v = &d->variable[k];
    const unsigned f = (unsigned)d->source->simulated->freedom, at = v->reference % KEMPE_FMU_BLOCK;
    const bool second = d->plan->fmi == 2;
    kmp_text_printf(xml, "    <%s %s=\"%u\"", element, second ? "index" : "valueReference",
                    second ? (unsigned)k + 1 : v->reference);
    const int block = (int)(v->reference / KEMPE_FMU_BLOCK);
    const bool known = (block >= KEMPE_FMU_STATES && block <= KEMPE_FMU_OUTPUTS) || block == KEMPE_FMU_CONDITIONS;
    if (!initial && d->structure && known) {
        put_dependencies(xml, d, v->reference);
        if (v->state && at < f)
            kmp_text_put(xml, " dependenciesKind=\"constant\"");
    }
    kmp_text_put(xml, "/>\n");
}

/* The lists of the model structure, as bits, and the lists that have a variable. */
enum { OUTPUTS = 1, DERIVATIVES = 2, UNKNOWNS = 4, INDICATORS = 8 };

static int lists_of(const variable *v)
{
    const unsigned block = v->reference / KEMPE_FMU_BLOCK;
    const int lists = (strcmp(v->causality, "output") == 0 ? OUTPUTS : 0) | (v->state ? DERIVATIVES : 0);
    return lists | (lists || block == KEMPE_FMU_STATES ? UNKNOWNS : 0) |
           (block == KEMPE_FMU_CONDITIONS ? INDICATORS : 0);
}

static void put_structure(kmp_text *xml, const description *d)
{
    static const struct {
        const char *list, *element;
        int bit;
    } lists[] = {{"Outputs", "Output", OUTPUTS},
                 {"Derivatives", "ContinuousStateDerivative", DERIVATIVES},
                 {"InitialUnknowns", "InitialUnknown", UNKNOWNS},
                 {NULL, "EventIndicator", INDICATORS}};
    const bool second = d->plan->fmi == 2;
    kmp_text_put(xml, "  <ModelStructure>\n");
    for (size_t i = 0; i < sizeof lists / sizeof *lists; i++) {
        bool open = false;
        for (int k = 0; k < d->count; k++) {
            if (!(lists_of(&d->variable[k]) & lists[i].bit) || (second && !lists[i].list))
                continue;
            if (second && !open)
                kmp_text_printf(xml, "    <%s>\n", lists[i].list);
            open = true;
            put_entry(xml, d, second ? "Unknown" : lists[i].element, k, lists[i].bit == UNKNOWNS);
        }
        if (second && open)
            kmp_text_printf(xml, "    </%s>\n", lists[i].list);
    }
    kmp_text_put(xml, "  </ModelStructure>\n");
}

static void put_head(kmp_text *xml, const description *d)
{
    const kmp_unit_plan *plan = d->plan;
    int indicators = 0;
    for (int k = 0; k < d->count; k++)
        indicators += (lists_of(&d->variable[k]) & INDICATORS) != 0;
    kmp_text_printf(xml, "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiModelDescription fmiVersion=\"%s\"",
                    plan->fmi == 2 ? "2.0" : "3.0");
    put_attribute(xml, "modelName", plan->source->title);
    put_attribute(xml, plan->fmi == 2 ? "guid" : "instantiationToken", plan->token);
    put_attribute(xml, "description", "multibody mechanism with its loops closed inside");
    put_attribute(xml, "license", "documentation/licenses/license.txt holds for the runtime");
    put_attribute(xml, "generationTool", "Kempe " KEMPE_VERSION);
    kmp_text_put(xml, " variableNamingConvention=\"structured\"");
    if (plan->fmi == 2)
        kmp_text_printf(xml, " numberOfEventIndicators=\"%d\"", indicators);
    kmp_text_put(xml, ">\n");
}

/* -- terminals ---------------------------------------------------------------------------------------- */

/* Variables that belong together are a terminal: an input with its derivatives, a coordinate with its rate, the
 * components of the position, velocity and acceleration of a point. */
typedef enum terminal_kind { NONE, INPUT, COORDINATE, POINT } terminal_kind;

static const char *const kind_names[] = {"", "input", "coordinate", "point"};

/* The terminal of a variable, and its name there. */
typedef struct seat {
    terminal_kind kind;
    const char *name; /* of the terminal */
    int length;       /* of its name */
    const char *member, *component;
} seat;

static seat seat_of_output(const variable *v)
{
    static const char *const measures[] = {"position", "velocity", "acceleration"};
    static const char *const components[] = {".x", ".y", ".z"};
    const int length = (int)strlen(v->name);
    for (size_t k = 0; k < sizeof measures / sizeof *measures; k++) {
        const int word = (int)strlen(measures[k]);
        for (size_t i = 0; i < 3; i++)
            if (length > word + 3 && strncmp(v->name, measures[k], (size_t)word) == 0 && v->name[word] == '.' &&
                strcmp(v->name + length - 2, components[i]) == 0)
                return (seat){POINT, v->name + word + 1, length - word - 3, measures[k], components[i]};
    }
    return (seat){0};
}

static seat seat_of(const variable *v)
{
    static const char *const members[] = {"value", "d", "dd"};
    const int order = (int)(v->reference % KEMPE_FMU_BLOCK) % 3;
    switch (v->reference / KEMPE_FMU_BLOCK) {
    case KEMPE_FMU_INPUTS: /* without the ending of a derivative: all three have the same order of it */
        return (seat){INPUT, v->name, (int)strlen(v->name) - (order ? order + 1 : 0), members[order], ""};
    case KEMPE_FMU_Q:
        return (seat){COORDINATE, v->name + 2, (int)strlen(v->name) - 2, "q", ""};
    case KEMPE_FMU_QD:
        return (seat){COORDINATE, v->name + 3, (int)strlen(v->name) - 3, "qd", ""};
    case KEMPE_FMU_OUTPUTS:
        return seat_of_output(v);
    default:
        return (seat){0};
    }
}

static bool is_same(const seat *a, const seat *b)
{
    return a->kind == b->kind && a->length == b->length && strncmp(a->name, b->name, (size_t)a->length) == 0;
}

/* True for the first of several variables that are a terminal. */
static bool begins_terminal(const variable *variables, int count, int first)
{
    const seat at = seat_of(&variables[first]);
    int members = 0;
    for (int k = 0; at.kind && k < count; k++) {
        const seat other = seat_of(&variables[k]);
        if (!other.kind || !is_same(&at, &other))
            continue;
        if (k < first)
            return false;
        members++;
    }
    return members > 1;
}

/* The terminal of a variable that is the first of it. */
static void put_terminal(kmp_text *xml, const variable *variables, int count, int first)
{
    const seat at = seat_of(&variables[first]);
    kmp_text name = {0};
    kmp_text_printf(&name, "%s.%.*s", kind_names[at.kind], at.length, at.name);
    kmp_text_put(xml, "    <Terminal");
    put_attribute(xml, "name", name.s);
    kmp_text_put(xml, " matchingRule=\"bus\">\n");
    for (int k = first; k < count; k++) {
        const seat other = seat_of(&variables[k]);
        if (!other.kind || !is_same(&at, &other))
            continue;
        kmp_text_put(xml, "      <TerminalMemberVariable");
        put_attribute(xml, "variableName", variables[k].name);
        kmp_text_printf(xml, " memberName=\"%s%s\" variableKind=\"signal\"/>\n", other.member, other.component);
    }
    kmp_text_put(xml, "    </Terminal>\n");
    kmp_text_free_part(xml, &name);
}

/* -- files -------------------------------------------------------------------------------------------- */

/* terminalsAndIcons.xml: terminals for variables that belong together, and the place of the icon. */
static void put_terminals(kmp_text *xml, const variable *variables, int count)
{
    bool open = false;
    kmp_text_printf(xml,
                    "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiTerminalsAndIcons fmiVersion=\"3.0\">\n"
                    "  <GraphicalRepresentation>\n"
                    "    <CoordinateSystem x1=\"0\" y1=\"0\" x2=\"%d\" y2=\"%d\" "
                    "suggestedScalingFactorTo_mm=\"0.1\"/>\n"
                    "    <Icon x1=\"0\" y1=\"0\" x2=\"%d\" y2=\"%d\"/>\n  </GraphicalRepresentation>\n",
                    KMP_UNIT_ICON, KMP_UNIT_ICON, KMP_UNIT_ICON, KMP_UNIT_ICON);
    for (int k = 0; k < count; k++)
        if (begins_terminal(variables, count, k)) {
            kmp_text_put(xml, open ? "" : "  <Terminals>\n");
            open = true;
            put_terminal(xml, variables, count, k);
        }
    kmp_text_put(xml, open ? "  </Terminals>\n</fmiTerminalsAndIcons>\n" : "</fmiTerminalsAndIcons>\n");
}

bool kmp_unit_describe(kmp_text *xml, kmp_text *terminals, const kmp_unit_plan *plan)
{
    description d = {.plan = plan, .source = plan->source};
    bool ok = list_variables(&d);
    d.structure = ok && !plan->on_library ? find_structure(&d.arena, plan->source) : NULL;
    ok = ok && (d.structure || plan->on_library);
    if (ok) {
        put_head(xml, &d);
        if (plan->exchange)
            put_kind(xml, plan, true);
        if (plan->simulation)
            put_kind(xml, plan, false);
        put_units(xml, &d);
        put_categories(xml);
        put_experiment(xml, plan->source->model);
        put_variables(xml, &d);
        put_structure(xml, &d);
        kmp_text_put(xml, "</fmiModelDescription>\n");
        if (plan->fmi == 3)
            put_terminals(terminals, d.variable, d.count);
    }
    kmp_arena_free(&d.arena);
    return ok && !xml->failed && !terminals->failed;
}

void kmp_unit_build_description(kmp_text *xml, const kmp_unit_plan *plan)
{
    kmp_text_put(xml, "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiBuildDescription fmiVersion=\"3.0\">\n"
                      "  <BuildConfiguration");
    put_attribute(xml, "modelIdentifier", plan->source->name);
    kmp_text_put(xml, ">\n    <SourceFileSet language=\"C99\">\n");
    for (int k = 0; k < plan->source_count; k++) {
        kmp_text_put(xml, "      <SourceFile");
        put_attribute(xml, "name", plan->sources[k]);
        kmp_text_put(xml, "/>\n");
    }
    kmp_text_put(xml, "    </SourceFileSet>\n    <Library name=\"m\" external=\"true\"/>\n  </BuildConfiguration>\n"
                      "</fmiBuildDescription>\n");
}
