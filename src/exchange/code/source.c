/* SPDX-License-Identifier: BSD-3-Clause */
/* Collects the input of a language: equations of the requested sets, one program for each routine, names of arguments
 * and shapes of results. */
#include "exchange/code/source.h"
#include "base/arena.h"
#include "base/context.h"
#include "base/memory.h"
#include "base/text.h"
#include "constraints/inexact/nearest_exact.h"
#include "dynamics/choose_variants.h"
#include "dynamics/equations.h"
#include "dynamics/kinematics/kinematics_conditions.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/link_tree.h"
#include "dynamics/load_dependent.h"
#include "dynamics/motion.h"
#include "exchange/code/block_parts.h"
#include "exchange/code/simulated.h"
#include "exchange/code/written_loads.h"
#include "model/data/closure.h"
#include "model/data/force.h"
#include "model/data/model.h"
#include "model/data/numbers.h"
#include "model/data/output_table.h"
#include "model/data/state.h"
#include "model/language/expression.h"
#include "model/language/expression_value.h"
#include "model/read/loads.h"
#include "model/write/model_json.h"
#include "symbolic/table_function.h"
#include <ctype.h>
#include <kempe/kempe.h>
#include <stdbool.h>
#include <string.h>

const char *const kmp_argument_names[KMP_ARGUMENTS] = {
    [KMP_IN_PARAMETER] = "k",   [KMP_IN_TIME] = "t",         [KMP_IN_Q] = "q",         [KMP_IN_QD] = "qd",
    [KMP_IN_QDD] = "qdd",       [KMP_IN_LAMBDA] = "lambda_", [KMP_IN_MODE] = "modes",  [KMP_IN_FORCE] = "force",
    [KMP_IN_TORQUE] = "torque", [KMP_IN_ALONG] = "way",      [KMP_IN_CHART] = "chart", [KMP_ARGUMENT_INPUTS] = "u"};

int kmp_argument_of(const kmp_program_input *input)
{
    return input->kind == KMP_IN_TIME && input->index > 0 ? KMP_ARGUMENT_INPUTS : (int)input->kind;
}

int kmp_place_in_argument(const kmp_code_source *source, const kmp_program_input *input)
{
    const int index = (int)input->index;
    if (input->kind == KMP_IN_MODE && !source->simulator)
        return source->mode_entries * (index / KMP_ROLES_OF_ALL) + index % KMP_ROLES_OF_ALL;
    return index - (kmp_argument_of(input) == KMP_ARGUMENT_INPUTS);
}

/* -- request --------------------------------------------------------------------------------------------- */

static const char *const schemes[] = {[KMP_SCHEME_COMPOSITE] = "composite", [KMP_SCHEME_NER] = "ner"};

/* The sets of a name, or of several with + between. */
static kempe_status read_sum(kempe_context *context, const char *name, size_t length, unsigned *sets)
{
    *sets = 0;
    for (size_t at = 0; at <= length;) {
        size_t part = strcspn(name + at, "+,");
        part = at + part > length ? length - at : part;
        unsigned found = kmp_sets_find(name + at, part);
        if (!found) {
            kmp_text sentence = {0};
            kmp_text_printf(&sentence, "unknown set '%.*s'; sets are ", (int)part, name + at);
            kmp_sets_list(&sentence);
            kmp_text_put(&sentence, ", and several of them joined by +");
            return kmp_fail_text(context, KEMPE_E_ARGUMENT, &sentence);
        }
        *sets |= found;
        at += part + 1;
    }
    return KEMPE_OK;
}

static kempe_status add(kempe_context *context, kmp_set_choice *choice, const char *name, size_t length)
{
    unsigned sets;
    KMP_TRY(read_sum(context, name, length, &sets));
    for (int k = 0; k < choice->count; k++)
        if (choice->chosen[k].sets == sets)
            return KEMPE_OK;
    if (length >= KMP_CHOICE_NAME || choice->count == KMP_MOST_CHOSEN)
        return kmp_fail(context, KEMPE_E_ARGUMENT,
                        "--sets: at most %d sets or sums of them, each of fewer than %d characters", KMP_MOST_CHOSEN,
                        KMP_CHOICE_NAME);
    kmp_chosen *c = &choice->chosen[choice->count++];
    memcpy(c->name, name, length);
    c->sets = sets;
    choice->all |= sets;
    return KEMPE_OK;
}

/* Bodies without inputs have to exist, but may have no motion, and then no inputs anyway. */
static kempe_status check_bodies(const kempe_model *model, const char *names)
{
    size_t length = 0;
    for (const char *name = names; name && *name; name += length + (name[length] == ',')) {
        bool found = false;
        length = strcspn(name, ",");
        for (int b = 1; b < model->body_count && !found; b++)
            found = strlen(model->bodies[b].name) == length && strncmp(model->bodies[b].name, name, length) == 0;
        if (!found)
            return kmp_fail(model->context, KEMPE_E_ARGUMENT, "--no-inputs: unknown body '%.*s' in '%s'", (int)length,
                            name, model->name);
    }
    return KEMPE_OK;
}

/* Generated equations have no force of a friction that slips. */
static kempe_status refuse_frictions_in_levels(const kempe_model *model)
{
    for (int k = 0; k < model->force_count; k++)
        for (int c = 0; c < model->closure_count; c++)
            if (model->closures[c].kind == KMP_CLOSURE_friction && model->closures[c].force != k &&
                kmp_force_depends_on_closure(&model->forces[k], c))
                return kmp_fail(
                    model->context, KEMPE_E_ARGUMENT,
                    "generated code: the level of '%s' depends on the friction '%s', which is not supported "
                    "there; a unit with the library simulates it: kempe fmu --binary",
                    model->forces[k].name, model->closures[c].name);
    return KEMPE_OK;
}

/* Sets whose rows are elements or outputs of the model, which may have none. */
static kempe_status check_rows(const kempe_model *model, unsigned sets)
{
    const unsigned of_friction = kmp_sets_find("friction", strlen("friction"));
    const unsigned of_contacts = kmp_sets_find("contact", strlen("contact")) | 1u << KMP_EQ_IMPACT;
    if (sets & of_contacts && !kmp_model_has_contacts(model))
        return kmp_fail(model->context, KEMPE_E_ARGUMENT,
                        "the sets 'contact' and 'impact' are empty: '%s' has no rigid contacts; omit them",
                        model->name);
    if (sets & of_friction && !kmp_model_sticks(model))
        return kmp_fail(model->context, KEMPE_E_ARGUMENT,
                        "the set 'friction' is empty: '%s' has no friction that sticks; omit the set", model->name);
    if (sets & kmp_sets_find("discrete", strlen("discrete")) && !kmp_model_has_samples(model))
        return kmp_fail(model->context, KEMPE_E_ARGUMENT,
                        "the set 'discrete' is empty: '%s' has no states with samples or events; omit the set",
                        model->name);
    if (sets & kmp_sets_find("delay", strlen("delay")) && model->delay_count == 0)
        return kmp_fail(model->context, KEMPE_E_ARGUMENT,
                        "the set 'delay' is empty: '%s' has no continuous delays; omit the set", model->name);
    if (sets & 1u << KMP_EQ_OUTPUTS && kmp_outputs_width(model) == 0)
        return kmp_fail(model->context, KEMPE_E_ARGUMENT,
                        "the set 'outputs' is empty: '%s' lists no output under 'run' that q, qd, qdd and lambda are "
                        "not already; list some, or omit the set",
                        model->name);
    return KEMPE_OK;
}

/* True if the equations have values that are found by iterations. Places and guesses where these begin are numbers. */
static bool is_solved(const kempe_model *model)
{
    bool found = model->wheel_count > 0;
    for (int k = 0; k < model->unknowns_count; k++)
        found = found || model->unknowns[k].count > 0;
    return found;
}

void kmp_choice_free(kmp_set_choice *choice)
{
    kmp_events_free(&choice->modes);
}

kempe_status kmp_choice_read(const kempe_model *model, const kempe_generate_options *g, kmp_set_choice *choice)
{
    kempe_context *context = model->context;
    *choice = (kmp_set_choice){.scene = {.scheme = KMP_SCHEME_COMPOSITE,
                                         .keep = g->simulator && is_solved(model) ? KMP_KEEP_NOTHING
                                                 : g->simulator                   ? KMP_KEEP_PARAMETERS
                                                 : g->keep_parameters             ? KMP_KEEP_NUMBERS
                                                                                  : KMP_KEEP_NOTHING,
                                         .body_inputs = g->body_inputs,
                                         .no_inputs = g->no_inputs,
                                         .optimize = g->optimize,
                                         .loops_alone = !g->drives && !g->simulator && !kmp_uses_drives(model),
                                         .events = &choice->modes,
                                         .given_delays = true,
                                         .charted = g->simulator,
                                         .modes_alone = !g->simulator}};
    if (g->body_inputs && model->flexible_count > 0)
        return kmp_fail(
            context, KEMPE_E_ARGUMENT,
            "forces on bodies as inputs: body '%s' is flexible, and a force moves the point where it acts; give "
            "forces at points in the model, with inputs",
            model->bodies[model->flexibles[0].body].name);
    for (int k = 0; k < model->parameter_count && choice->scene.keep != KMP_KEEP_NOTHING; k++)
        if (kmp_extent_is_long(model->parameters[k].extent))
            return kmp_fail(context, KEMPE_E_ARGUMENT,
                            "parameter '%s' has %.3g operations and operands when the parameters in it are expanded, "
                            "in %d levels; generated code allows %d and %d: give '%s' as a number",
                            model->parameters[k].name, model->parameters[k].extent.size,
                            model->parameters[k].extent.level, KMP_MOST_WRITTEN_OUT, KMP_MOST_NAME_LEVELS,
                            model->parameters[k].name);
    const char *name = g->scheme;
    for (int k = 0; name && k < (int)(sizeof schemes / sizeof *schemes); k++)
        if (strcmp(schemes[k], name) == 0)
            choice->scene.scheme = (kmp_scheme)k;
    choice->scheme = schemes[choice->scene.scheme];
    if (name && strcmp(choice->scheme, name) != 0)
        return kmp_fail(context, KEMPE_E_ARGUMENT, "unknown scheme '%s'; schemes are composite, ner", name);
    KMP_TRY(refuse_frictions_in_levels(model));
    if (g->simulator) {
        KMP_TRY(kmp_refuse_delays(model, "generated simulators", KMP_INSTEAD_OF_DELAY));
        kmp_simulated_choose(model, choice);
        return KEMPE_OK;
    }
    for (const char *s = g->sets ? g->sets : "M_C,invdyn,h_J,jdqd"; s; s = strchr(s, ',')) {
        s += *s == ',';
        KMP_TRY(add(context, choice, s, strcspn(s, ",")));
    }
    KMP_TRY(check_rows(model, choice->all));
    return check_bodies(model, g->no_inputs);
}

/* -- names ------------------------------------------------------------------------------------------- */

/* FNV-1a over the model without its run settings (Fowler, Noll, Vo). */
static bool hash_model(const kempe_model *model, char out[17])
{
    kmp_text text = {0};
    uint64_t hash = 14695981039346656037u;
    kmp_model_json_mechanism(&text, model);
    for (size_t k = 0; !text.failed && k < text.length; k++)
        hash = (hash ^ (unsigned char)text.s[k]) * 1099511628211u;
    for (int k = 15; k >= 0; k--, hash >>= 4)
        out[k] = "0123456789abcdef"[hash & 15];
    out[16] = '\0';
    bool ok = !text.failed;
    kmp_text_free(&text);
    return ok;
}

static void find_rows(kmp_code_elements *elements, const kmp_equations *eq)
{
    for (int k = 0; k < elements->count; k++)
        elements->row[k] = eq->closures.first[KMP_CLOSURE_ROWS * elements->force[k]->closure];
}

static void name_rows(kmp_code_source *source, const kmp_equations *eq)
{
    if (source->row_names || eq->m == 0)
        return;
    source->m = eq->m;
    find_rows(&source->frictions, eq);
    find_rows(&source->contacts, eq);
    source->row_names = KMP_ARENA_NEW(&source->arena, char *, eq->m);
    for (int r = 0; source->row_names && r < eq->m; r++) {
        const kmp_row *row = &eq->closures.rows[r];
        source->row_names[r] =
            kmp_arena_printf(&source->arena, "%s.%d", eq->model->closures[row->closure].name, row->number + 1);
    }
}

/* The columns of the outputs. */
static void name_outputs(kmp_code_source *source)
{
    const kempe_model *model = source->model;
    int count = 0;
    source->output_count = kmp_outputs_width(model);
    source->output_names = KMP_ARENA_NEW(&source->arena, char *, source->output_count);
    for (int o = 0; source->output_names && o < model->output_count; o++)
        for (int k = 0; k < kmp_output_width(model, &model->outputs[o]); k++) {
            kmp_text text = {0};
            kmp_output_column(&text, model, &model->outputs[o], k);
            source->output_names[count++] = kmp_text_keep(&text, &source->arena);
        }
}

static void add_element(kmp_code_source *source, kmp_code_elements *elements, const kmp_force *force)
{
    int e = elements->count++;
    elements->names[e] = kmp_arena_strdup(&source->arena, force->name);
    elements->force[e] = force;
    elements->mode[e] = source->mode_entries * source->elements.count;
}

/* Friction that sticks and rigid contacts, in the order of their modes. */
static void name_elements(kmp_code_source *source)
{
    const kempe_model *model = source->model;
    kmp_code_elements *const all[] = {&source->frictions, &source->contacts, &source->elements};
    const int room = model->force_count;
    for (int k = 0; k < 3; k++)
        KMP_ARENA_MAKE(&source->arena, KMP_ROOM(char *, room, &all[k]->names), KMP_ROOM(int, room, &all[k]->row),
                       KMP_ROOM(int, room, &all[k]->mode), KMP_ROOM(const kmp_force *, room, &all[k]->force));
    source->mode_entries = KMP_MODE_ENTRIES;
    for (int k = 0; k < room; k++)
        if (kmp_force_has_modes(&model->forces[k]) && model->forces[k].across > 0)
            source->mode_entries = KMP_MODE_ENTRIES_ACROSS;
    for (int k = 0; !source->arena.failed && k < room; k++)
        if (kmp_force_has_modes(&model->forces[k])) {
            add_element(source, all[kmp_force_sticks(&model->forces[k]) ? 0 : 1], &model->forces[k]);
            add_element(source, all[2], &model->forces[k]);
        }
}

/* States with samples or events, and continuous delays. */
static void name_states(kmp_code_source *source)
{
    const kempe_model *model = source->model;
    const int samples = kmp_model_has_samples(model) ? model->state_count : 0, delays = model->delay_count;
    if (!KMP_ARENA_MAKE(&source->arena, KMP_ROOM(char *, samples, &source->discrete_names),
                        KMP_ROOM(int, samples, &source->discrete_place),
                        KMP_ROOM(double, samples, &source->discrete_time),
                        KMP_ROOM(char *, delays, &source->delay_names),
                        KMP_ROOM(int, delays, &source->delay_place, &source->delay_given)))
        return;
    for (int k = 0; k < model->state_count; k++) {
        const kmp_state *state = &model->states[k];
        const int place = kmp_model_coordinates(model) + k;
        if (samples > 0 && state->next) {
            source->discrete_names[source->discrete_count] = kmp_arena_strdup(&source->arena, state->name);
            source->discrete_place[source->discrete_count] = place;
            source->discrete_time[source->discrete_count++] = state->period;
        }
        if (delays > 0 && state->delayed) {
            source->delay_names[source->delay_count] = kmp_arena_strdup(&source->arena, state->name);
            source->delay_given[source->delay_count] = state->before || state->began;
            source->delay_place[source->delay_count++] = place;
        }
    }
}

/* -- routines ---------------------------------------------------------------------------------------- */

/* The arguments of the equations of a set, with the arguments of the forces if it has forces. */
static unsigned arguments_of(const kmp_equations *eq, const kmp_set *set)
{
    const unsigned forced = KMP_SET_BIAS | KMP_SET_INVERSE | KMP_SET_INVERSE_Q | KMP_SET_INVERSE_QD |
                            KMP_SET_ACCELERATION | KMP_SET_CLOSED_Q;
    bool loaded = false, modes = false;
    for (int k = 0; k < eq->model->force_count; k++) {
        loaded = loaded || kmp_force_has_load(&eq->model->forces[k]);
        modes = modes || kmp_force_has_modes(&eq->model->forces[k]);
    }
    return (modes ? set->inputs : set->inputs & ~(1u << KMP_IN_MODE)) |
           (loaded && set->derive & forced ? 1u << KMP_IN_LAMBDA : 0);
}

/* Of a list its items. */
static void keep(kmp_code_routine *r, uint32_t operand)
{
    const kmp_program *p = r->program;
    int value = (int)(operand >> 1), input = value - p->constant_count, instruction = input - p->input_count;
    if (instruction >= 0 && p->instruction[instruction].op == KMP_OP_LIST) {
        if (instruction < p->code[1]) {
            keep(r, p->instruction[instruction].a);
            keep(r, p->instruction[instruction].b);
        }
        return;
    }
    bool parameter = input >= 0 && instruction < 0 && p->input[input].kind == KMP_IN_PARAMETER;
    if ((parameter || (instruction >= 0 && instruction < p->code[1])) && !r->kept[value])
        r->kept[value] = ++r->kept_count;
}

bool kmp_code_find_kept(kmp_arena *arena, kmp_code_routine *r)
{
    const kmp_program *p = r->program;
    r->kept = KMP_ARENA_NEW(arena, int, p->constant_count + p->input_count + p->code[p->stages]);
    if (!r->kept)
        return false;
    for (int i = p->code[1]; i < p->code[2]; i++)
        for (int k = 0; k < kmp_op_arity((kmp_op)p->instruction[i].op); k++)
            keep(r, kmp_instruction_operand(&p->instruction[i], k));
    for (int k = p->outputs[1]; k < p->outputs[2]; k++)
        keep(r, p->output[k]);
    return true;
}

static bool take_symbols(kmp_code_source *source, const kmp_tree *tree)
{
    if (source->place)
        return true;
    kmp_arena *arena = &source->arena;
    source->symbol_count = kmp_tree_symbol_count(tree);
    KMP_ARENA_MAKE(arena, KMP_ROOM(int, source->symbol_count, &source->place),
                   KMP_ROOM(double, source->symbol_count, &source->value),
                   KMP_ROOM(char *, source->symbol_count, &source->parameter_name));
    for (int k = 0; !arena->failed && k < source->symbol_count; k++)
        source->place[k] = -1;
    return !arena->failed;
}

/* A symbol has its value where it was met. */
static void take_values(kmp_code_source *source, const kmp_tree *tree)
{
    double *value = KMP_ARENA_NEW(&source->arena, double, source->symbol_count);
    if (!value)
        return;
    kmp_tree_symbol_values(tree, value);
    for (int k = 0; k < source->symbol_count; k++)
        if (value[k] != 0)
            source->value[k] = value[k];
}

bool kmp_code_take_program(kmp_code_source *source, kmp_code_routine *r)
{
    for (int k = 0; k < r->program->input_count; k++) {
        const kmp_program_input *in = &r->program->input[k];
        r->arguments |= in->kind == KMP_IN_LAMBDA ? 1u << KMP_IN_LAMBDA : 0; /* also of contacts of wheels */
        if (in->kind == KMP_IN_PARAMETER)
            source->place[in->index] = 0;
    }
    r->tally = kmp_tally_program(r->program, 0, 1);
    return kmp_code_find_kept(&source->arena, r) && kmp_code_blocks_make(source, r) == KEMPE_OK &&
           !source->arena.failed;
}

static void shape_arrays(const kmp_code_source *source, kmp_code_routine *r, const kmp_equations *eq, unsigned sets)
{
    const bool inputs = source->inputs;
    const unsigned loads = 1u << KMP_IN_FORCE | 1u << KMP_IN_TORQUE;
    int first = 0;
    r->arguments = 1u << KMP_IN_TIME | 1u << KMP_IN_Q;
    r->arguments |= kmp_model_given_inputs(eq->model) > 0 ? 1u << KMP_ARGUMENT_INPUTS : 0;
    r->arguments |= source->simulator ? KMP_SIMULATOR_ARGUMENTS : 0;
    for (int k = 0; k < KMP_EQ_SETS; k++) {
        if (!(sets & 1u << k))
            continue;
        kmp_set set = kmp_set_of(eq, k);
        r->arrays[r->array_count++] = (kmp_array){.name = set.array,
                                                  .meaning = set.meaning,
                                                  .rows = set.rows,
                                                  .cols = set.columns,
                                                  .symmetric = set.lower,
                                                  .first = first,
                                                  .count = kmp_set_size(&set)};
        r->arguments |= inputs ? arguments_of(eq, &set) : arguments_of(eq, &set) & ~loads;
        first += kmp_set_size(&set);
    }
}

static bool take_routine(kmp_code_source *source, kmp_code_routine *r, const kmp_chosen *chosen,
                         const kmp_equations *eq)
{
    strcpy(r->name, chosen->name);
    for (char *s = r->name; *s; s++)
        *s = *s == '+' ? '_' : *s;
    r->program = kmp_sets_program(eq, chosen->sets);
    name_rows(source, eq);
    if (!r->program || !take_symbols(source, &eq->tree))
        return false;
    take_values(source, &eq->tree);
    if (eq->links.symbols)
        take_values(source, &eq->links);
    shape_arrays(source, r, eq, chosen->sets);
    return kmp_code_take_program(source, r);
}

static kempe_status derive(kmp_code_source *source, kmp_code_routine *r, const kmp_set_choice *choice,
                           const kmp_chosen *chosen)
{
    kmp_equations eq;
    kmp_derivation_request scene = choice->scene;
    scene.sets = kmp_sets_derive(chosen->sets);
    scene.events = chosen->in_place ? NULL : scene.events;
    scene.labels = source->legible && !source->vectorised;
    kempe_status status = kmp_equations_derive(&eq, source->model, &scene);
    if (status != KEMPE_OK)
        return status;
    if (!take_routine(source, r, chosen, &eq))
        status = kmp_fail_memory(source->context);
    kmp_equations_free(&eq);
    return status;
}

/* -- symbols --------------------------------------------------------------------------------------------- */

typedef struct search {
    kmp_text *text;
    int symbol;
} search;

/* Appends the name when the number has the symbol, and ends the walk. */
static bool is_other(void *user, const kmp_number *number, const char *owner, const char *key, const char *part)
{
    search *s = user;
    if (number->symbol != s->symbol)
        return true;
    kmp_text_printf(s->text, "%s%s%s%s%s", owner, *key ? "." : "", key, part ? "." : "", part ? part : "");
    return false;
}

/* A law that is one number. */
static bool is_law(const search *s, const kmp_expr *law, const char *owner, const char *what)
{
    if (!law || law->symbol != s->symbol)
        return false;
    kmp_text_printf(s->text, "%s.%s", owner, what);
    return true;
}

static bool find_law(const search *s, const kempe_model *model)
{
    static const char *const curves[] = {"curve.1", "curve.2"}, *const xyz[] = {"x", "y", "z"};
    bool found = false;
    for (int k = 0; k < model->closure_count && !found; k++) {
        const kmp_closure *closure = &model->closures[k];
        found = is_law(s, closure->function, closure->name, "function");
        for (int i = 0; i < 2 && !found; i++)
            found = is_law(s, closure->curve[i], closure->name, curves[i]);
    }
    for (int k = 0; k < model->force_count && !found; k++) {
        const kmp_force *force = &model->forces[k];
        found = is_law(s, force->effort, force->name, "effort");
        for (int i = 0; i < 3 && !found; i++)
            found = is_law(s, force->vector[i], force->name, xyz[i]);
    }
    for (int k = 0; k < model->unknowns_count && !found; k++)
        found =
            model->unknowns[k].count == 0 && is_law(s, model->unknowns[k].zero[0], model->unknowns[k].name, "value");
    return found;
}

/* -- tables ------------------------------------------------------------------------------------------- */

/* The tables of all routines and of the parts of their blocks, each once. */
static bool list_tables(kmp_code_source *source)
{
    const kmp_program *p;
    int most = 0;
    for (int r = 0; r < source->count; r++)
        for (int i = 0; (p = kmp_code_next_program(&source->routines[r], &i));)
            most += p->table_count;
    source->tables = KMP_ARENA_NEW(&source->arena, const kmp_table *, most);
    source->table_count = 0;
    for (int r = 0; source->tables && r < source->count; r++)
        for (int i = 0; (p = kmp_code_next_program(&source->routines[r], &i));)
            for (int k = 0; k < p->table_count; k++)
                if (kmp_code_table_number(source, p->table[k]) < 0)
                    source->tables[source->table_count++] = p->table[k];
    return source->tables;
}

bool kmp_code_has_table(const kmp_code_routine *routine, const kmp_table *table)
{
    const kmp_program *p;
    bool found = false;
    for (int i = 0; (p = kmp_code_next_program(routine, &i));)
        for (int k = 0; k < p->table_count; k++)
            found = found || kmp_table_equal(p->table[k], table);
    return found;
}

int kmp_code_table_number(const kmp_code_source *source, const kmp_table *table)
{
    for (int k = 0; k < source->table_count; k++)
        if (kmp_table_equal(source->tables[k], table))
            return k;
    return -1;
}

/* Parameters of which p has no entry, because more than numbers depends on them. */
static bool warn_of_shapes(const kempe_model *model)
{
    kmp_text names = {0};
    for (int k = 0; k < model->parameter_count; k++)
        if (model->parameters[k].shapes)
            kmp_text_printf(&names, "%s%s", names.length > 0 ? ", " : "", model->parameters[k].name);
    if (names.length > 0)
        kmp_log(model->context, KEMPE_LOG_WARNING,
                "axes, tables or powers depend on these parameters: they are written as numbers, and p has no entry "
                "for them: %s",
                names.s);
    bool ok = !names.failed;
    kmp_text_free(&names);
    return ok;
}

/* The name of symbol k (parameters first, then numbers in the order of reading): a parameter's name, "crank.mass",
 * "coupler.B.x". In the arena; NULL: no memory. */
static char *symbol_name(kmp_arena *arena, const kempe_model *model, int k)
{
    kmp_text text = {0};
    int symbol = k - model->parameter_count + 1;
    search s = {&text, symbol};
    if (symbol <= 0)
        kmp_text_put(&text, model->parameters[k].name);
    else if (kmp_numbers_visit(model, is_other, &s) && !find_law(&s, model))
        kmp_text_printf(&text, "number.%d", symbol);
    return kmp_text_keep(&text, arena);
}

/* Places in p, in the order of the symbols, for parameters that some routine needs. */
static bool place_symbols(kmp_code_source *source)
{
    for (int k = 0; k < source->symbol_count; k++) {
        if (source->place[k] < 0)
            continue;
        int at = source->place[k] = source->parameter_count++;
        source->value[at] = source->value[k]; /* at <= k */
        source->parameter_name[at] = symbol_name(&source->arena, source->model, k);
    }
    return !source->arena.failed;
}

static void name_all(kmp_code_source *source, const kempe_model *model)
{
    kmp_arena *arena = &source->arena;
    source->title = kmp_arena_strdup(arena, model->name);
    /* The model's name as an identifier. */
    const char *name = model->name;
    kmp_text text = {0};
    if (!isalpha((unsigned char)name[0]))
        kmp_text_put(&text, "m_");
    for (; *name; name++)
        kmp_text_printf(&text, "%c", isalnum((unsigned char)*name) ? *name : '_');
    source->name = kmp_text_keep(&text, arena);
    source->coordinate_names = KMP_ARENA_NEW(arena, char *, source->n);
    for (int k = 0; source->coordinate_names && k < source->n; k++)
        source->coordinate_names[k] = kmp_arena_strdup(arena, model->motions[k].name);
    source->input_count = kmp_model_given_inputs(model);
    source->input_names = KMP_ARENA_NEW(arena, char *, source->input_count);
    source->input_order = KMP_ARENA_NEW(arena, int, source->input_count);
    for (int k = 0; source->input_names && k < source->input_count; k++)
        source->input_names[k] = kmp_arena_strdup(arena, model->inputs[k].name);
    name_outputs(source);
}

/* Parameters of which something depends; their place is that in the model. */
static void take_set_parameters(kmp_code_source *source, const kempe_model *model)
{
    const int room = model->parameter_count;
    if (!KMP_ARENA_MAKE(&source->arena, KMP_ROOM(double, room, &source->value),
                        KMP_ROOM(char *, room, &source->parameter_name)))
        return;
    for (int k = 0; k < room; k++)
        if (!model->parameters[k].unused) {
            source->simulated->symbol[source->parameter_count] = k;
            source->simulated->fixed[source->parameter_count] = 1;
            source->value[source->parameter_count] = model->parameters[k].number.value;
            source->parameter_name[source->parameter_count++] =
                kmp_arena_strdup(&source->arena, model->parameters[k].name);
        }
}

kempe_status kmp_source_describe(kmp_code_source *source, const kempe_model *model, const kempe_system *system)
{
    *source = (kmp_code_source){.context = model->context, .model = model, .n = model->motion_count};
    kmp_arena *arena = &source->arena;
    name_all(source, model);
    source->m = system->m;
    source->row_names = KMP_ARENA_NEW(arena, char *, system->m);
    for (int r = 0; source->row_names && r < system->m; r++)
        source->row_names[r] = kmp_arena_strdup(arena, system->row_names[r]);
    struct kmp_simulated *x = source->simulated = KMP_ARENA_NEW(arena, struct kmp_simulated, 1);
    if (x && KMP_ARENA_MAKE(arena, KMP_ROOM(int, model->parameter_count, &x->symbol, &x->fixed),
                            KMP_ROOM(int, source->n, &x->coordinate_kind)))
        take_set_parameters(source, model);
    kempe_status status = kmp_made(model->context, !arena->failed && hash_model(model, source->hash));
    if (status == KEMPE_OK)
        status = kmp_motion_need(system);
    for (int k = 0; status == KEMPE_OK && k < source->input_count; k++)
        source->input_order[k] = kmp_system_input_order(system, k);
    if (status == KEMPE_OK)
        status = kmp_simulated_start(source, system);
    if (status != KEMPE_OK)
        kmp_source_free(source);
    return status;
}

/* Of a simulator, from the programs of its motion and its outputs. */
static void find_input_orders(kmp_code_source *source)
{
    static const char *const routines[] = {"closures", "motion", "loads", "show"};
    for (size_t r = 0; source->simulator && r < sizeof routines / sizeof *routines; r++) {
        const kmp_code_routine *routine = kmp_simulated_routine(source, routines[r]);
        for (int k = 0; routine && k < source->input_count; k++) {
            const int order = kmp_program_time_order(routine->program, k);
            source->input_order[k] = order > source->input_order[k] ? order : source->input_order[k];
        }
    }
}

static kempe_status make(kmp_code_source *source, const kempe_model *model, const kempe_generate_options *g,
                         kmp_set_choice *choice)
{
    kmp_arena *arena = &source->arena;
    source->legible = !g->form || strcmp(g->form, "legible") == 0;
    if (!source->legible && strcmp(g->form, "compact") != 0)
        return kmp_fail(source->context, KEMPE_E_ARGUMENT, "unknown form '%s'; forms are legible, compact", g->form);
    KMP_TRY(kmp_choice_read(model, g, choice));
    if (choice->all & (1u << KMP_EQ_R_Q))
        KMP_TRY(kmp_refuse_load_dependent_model(model, "set 'R_q'"));
    /* For a rounded drawing the exact mechanism is written, which all computations use
     * (constraints/inexact/nearest_exact.h). */
    if (model->closure_count > 0)
        KMP_TRY(kmp_meant(model, &source->meant));
    source->model = source->meant ? kmp_variant_model(source->meant) : model;
    source->vectorised = g->vectorised;
    source->parameters = g->keep_parameters || g->simulator;
    source->simulator = g->simulator;
    source->inputs = g->body_inputs;
    source->body_count = model->body_count - 1;
    source->scheme = choice->scheme;
    source->routines = KMP_ARENA_NEW(arena, kmp_code_routine, choice->count + (g->simulator ? KMP_SLOPES_MOST : 0));
    name_all(source, model);
    name_elements(source);
    name_states(source);
    KMP_TRY(kmp_made(model->context, !arena->failed && hash_model(model, source->hash)));
    for (int k = 0; k < choice->count; k++)
        KMP_TRY(derive(source, &source->routines[source->count++], choice, &choice->chosen[k]));
    if (source->simulator)
        KMP_TRY(kmp_simulated_find(source, choice));
    KMP_TRY(kmp_made(source->context, place_symbols(source) && (!source->parameters || warn_of_shapes(source->model))));
    KMP_TRY(kmp_made(source->context, list_tables(source)));
    find_input_orders(source);
    return source->simulator ? kmp_simulated_place(source) : KEMPE_OK;
}

kempe_status kmp_source_init(kmp_code_source *source, const kempe_model *model, const kempe_generate_options *g)
{
    *source = (kmp_code_source){.context = model->context, .model = model, .n = model->motion_count};
    kmp_set_choice choice = {0};
    kempe_status status = make(source, model, g, &choice);
    kmp_choice_free(&choice);
    if (status != KEMPE_OK)
        kmp_source_free(source);
    return status;
}

void kmp_source_free(kmp_code_source *source)
{
    for (int k = 0; k < source->count; k++) {
        kmp_code_blocks_free(&source->routines[k]);
        kmp_program_free(source->routines[k].program);
    }
    kmp_arena_free(&source->arena);
    kmp_variant_free(source->meant);
    *source = (kmp_code_source){0};
}

/* -- files ------------------------------------------------------------------------------------------- */

kmp_text *kmp_code_add(kmp_code_files *files, const char *format, ...)
{
    kmp_text name = {0};
    KMP_TEXT_ARGUMENTS(&name, format);
    char *taken = kmp_text_take(&name);
    kmp_code_file *file = taken ? kmp_realloc(files->file, (size_t)files->count + 1, sizeof *file) : NULL;
    files->file = file ? file : files->file;
    if (!file) {
        kmp_free(taken);
        return NULL;
    }
    file[files->count] = (kmp_code_file){.name = taken};
    return &file[files->count++].text;
}

void kmp_code_files_free(kmp_code_files *files)
{
    for (int k = 0; k < files->count; k++) {
        kmp_free(files->file[k].name);
        kmp_text_free(&files->file[k].text);
    }
    kmp_free(files->file);
    *files = (kmp_code_files){0};
}
