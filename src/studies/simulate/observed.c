/* SPDX-License-Identifier: BSD-3-Clause */
/* Outputs of a mechanism: as columns of a trajectory, at states that are known already, and by handle. */
#include "studies/simulate/observed.h"
#include "base/memory.h"
#include "constraints/closing/assembly.h"
#include "constraints/partition/reduction.h"
#include "constraints/tolerances.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "integrators/run/runner_change.h"
#include "model/data/closure_table.h"
#include "model/data/coordinates.h"
#include "model/data/force_table.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include "model/read/loads.h"
#include "model/read/requests.h"
#include "output/print.h"
#include "studies/simulate/stepper_run.h"
#include "symbolic/derivative.h"
#include <kempe/check.h>
#include <kempe/output_handles.h>
#include <math.h>
#include <string.h>

/* The stage of the values, and the first and number of the ones that a caller may add. */
enum { OBSERVED_VALUES = 1, OBSERVED_MORE, OBSERVED_ADDED = 2 };

/* -- columns --------------------------------------------------------------------------------------------- */

/* A trajectory as columns: time, then the model's outputs, in their order; each with its unit. */

/* The quantity of an output whose values are in the table. */
static kmp_quantity quantity_of(kmp_output_kind kind)
{
    return kind == KMP_OUTPUT_Q       ? KMP_QUANTITY_Q
           : kind == KMP_OUTPUT_QD    ? KMP_QUANTITY_QD
           : kind == KMP_OUTPUT_QDD   ? KMP_QUANTITY_QDD
           : kind == KMP_OUTPUT_STATE ? KMP_QUANTITY_STATE
                                      : KMP_QUANTITY_LAMBDA;
}

/* True for an output that occurs twice, or one of a quantity that is complete already: it gives no second column. */
static bool is_repeated(const kempe_model *model, int output)
{
    const kmp_output *o = &model->outputs[output];
    for (int k = 0; k < model->output_count; k++) {
        const kmp_output *other = &model->outputs[k];
        if (k < output && kmp_output_equal(other, o))
            return true;
        if (kmp_output_includes(other, o) && !kmp_output_equal(other, o))
            return true;
    }
    return false;
}

static void add_column(kmp_columns *columns, kmp_text *name, const char *unit, kmp_column of)
{
    int k = columns->count++;
    columns->name[k] = kmp_arena_strdup(&columns->arena, name->s ? name->s : "");
    columns->unit[k] = unit;
    columns->of[k] = of;
    columns->arena.failed = columns->arena.failed || name->failed;
    kmp_text_free(name);
}

static void add_computed(kmp_columns *columns, const kempe_model *model, const unsigned *parts, int o, int first)
{
    const kmp_output *output = &model->outputs[o];
    for (int k = 0; k < kmp_output_width(model, output); k++) {
        kmp_text name = {0};
        /* Components beyond the bits have no separate words. */
        if (parts && k < 32 && !(parts[o] >> k & 1u))
            continue;
        kmp_output_column(&name, model, output, k);
        const char *unit = kmp_output_unit(model, output, k);
        unit = output->kind == KMP_OUTPUT_SENSOR ? kmp_print_unknown(model->context, unit) : unit;
        add_column(columns, &name, unit, (kmp_column){KMP_QUANTITIES, first + k, o, k});
    }
}

static void add_from_table(kmp_columns *columns, const kempe_system *system, const kempe_model *model, int o)
{
    const kmp_output *output = &model->outputs[o];
    kmp_quantity quantity = quantity_of(output->kind);
    for (int k = 0; k < kmp_quantity_size(system, quantity); k++) {
        kmp_text name = {0};
        /* lambda(CLOSURE) has only that closure's rows, q(JOINT) that coordinate. */
        if (output->index >= 0 && (output->kind == KMP_OUTPUT_LAMBDA ? system->rows[k].closure : k) != output->index)
            continue;
        kmp_text_printf(&name, "%s.%s", kmp_quantity_prefix(quantity), kmp_quantity_name(system, quantity, k));
        /* A state is the rate of its motion. */
        bool state = quantity == KMP_QUANTITY_STATE;
        int index = state ? kmp_model_coordinates(system->model) + k : k;
        add_column(columns, &name, kmp_print_unknown(system->context, kmp_quantity_unit(system, quantity, k)),
                   (kmp_column){state ? KMP_QUANTITY_QD : quantity, index, o, 0});
    }
}

bool kmp_columns_init(kmp_columns *columns, const kempe_system *system, const kempe_model *model, const unsigned *parts)
{
    int most = 1; /* columns if every output had all that it could have */
    *columns = (kmp_columns){0};
    for (int o = 0; o < model->output_count; o++) {
        int width = kmp_output_width(model, &model->outputs[o]);
        most += width > 0 ? width : kmp_quantity_size(system, quantity_of(model->outputs[o].kind));
    }
    KMP_ARENA_MAKE(&columns->arena, KMP_ROOM(char *, most, &columns->name),
                   KMP_ROOM(const char *, most, &columns->unit), KMP_ROOM(kmp_column, most, &columns->of));
    if (!columns->arena.failed) {
        kmp_text time = {0};
        int shown = 0;
        kmp_text_put(&time, "t");
        add_column(columns, &time, "s", (kmp_column){KMP_QUANTITIES, -1, -1, 0});
        for (int o = 0; o < model->output_count; o++) {
            int width = kmp_output_width(model, &model->outputs[o]);
            if (!is_repeated(model, o) && width > 0)
                add_computed(columns, model, parts, o, shown);
            else if (!is_repeated(model, o))
                add_from_table(columns, system, model, o);
            shown += width;
        }
    }
    bool ok = !columns->arena.failed;
    if (!ok)
        kmp_columns_free(columns);
    return ok;
}

KMP_CLEARS(kmp_columns, columns, kmp_arena_free(&columns->arena))

void kmp_columns_fill(const kmp_samples *table, const kmp_columns *columns, kmp_evaluator *eval, int row,
                      double *values)
{
    const double *shown = kmp_samples_shown(table, eval, row);
    values[0] = kmp_samples_time(table, row);
    for (int k = 1; k < columns->count; k++) {
        const kmp_column *of = &columns->of[k];
        const double *from = of->quantity == KMP_QUANTITIES ? shown : kmp_samples_get(table, of->quantity, row);
        values[k] = from[of->index];
    }
}

/* -- all outputs of a model -------------------------------------------------------------------------- */

/* The list under construction. Outputs of which a quantity is complete are not counted. */
typedef struct listing {
    kempe_model *model;
    kmp_output *list;
    int count, columns, most, left_out;
} listing;

static void add(listing *l, kmp_output output, bool wanted)
{
    const kempe_model *model = l->model;
    int width = kmp_output_width(model, &output);
    int columns = width > 0 ? width : output.index < 0 ? model->motion_count : 1;
    for (int k = 0; k < l->count; k++)
        if (kmp_output_includes(&l->list[k], &output))
            return;
    if (!wanted && l->columns + columns > l->most) {
        l->left_out++;
        return;
    }
    l->columns += columns;
    l->list[l->count++] = output;
}

/* Drives have no reaction between bodies; reactions of joints of the tree and forces of
 * bearings are computed only on request. A force that is
 * given by its components has no separate value. */
static bool has_output(const kempe_model *model, kmp_output_kind kind, int index)
{
    bool of_loop = kmp_output_rows[kind].argument == KMP_OUTPUT_OF_LOOP;
    const kmp_output_argument argument = kmp_output_rows[kind].argument;
    if (argument == KMP_OUTPUT_OF_JOINT || argument == KMP_OUTPUT_OF_BEARING)
        return false;
    if (kind == KMP_OUTPUT_CAM_FORCE || kind == KMP_OUTPUT_PRESSURE_ANGLE || kind == KMP_OUTPUT_CURVATURE)
        return model->closures[index].cam;
    if (kind == KMP_OUTPUT_TOUCH_PRESSURE_ANGLE || kind == KMP_OUTPUT_TOUCH_CURVATURE)
        return model->forces[index].touch.side[1].cam;
    if (of_loop)
        return !kmp_closure_is_drive(&model->closures[index]);
    if (kind == KMP_OUTPUT_SECTION || kind == KMP_OUTPUT_STRESS)
        return false; /* only on request, as loads of joints */
    if (kind == KMP_OUTPUT_DEFLECTION || kind == KMP_OUTPUT_STRAINED)
        return !kmp_output_obstacle(model, kind, index);
    if (kmp_output_rows[kind].argument == KMP_OUTPUT_OF_POINT)
        return model->points[index].body > 0; /* points of the ground rest */
    if (kind == KMP_OUTPUT_OUTLINE_GAP)
        return model->forces[model->outline_contacts[index].first].kind == KMP_FORCE_TOUCH;
    if (kind == KMP_OUTPUT_GAP)
        return model->forces[index].kind == KMP_FORCE_TOUCH;
    return kind != KMP_OUTPUT_FORCE ||
           !(kmp_force_has_components(&model->forces[index]) || model->forces[index].kind == KMP_FORCE_STATE);
}

/* The kinds in the order of their rows, with the words that a reader looks for first before the words of points. */
static void list_kind(listing *l, kmp_output_kind kind)
{
    const kempe_model *model = l->model;
    if (kind == KMP_OUTPUT_STATE && model->state_count == 0)
        return;
    if (kmp_output_stands_alone(kind)) {
        add(l, (kmp_output){.kind = kind, .index = -1}, false);
        return;
    }
    int count = kmp_output_names(model, kmp_output_rows[kind].argument).count;
    for (int k = 0; k < count; k++)
        if (has_output(model, kind, k))
            add(l, (kmp_output){.kind = kind, .index = k}, false);
}

static kempe_status list_all(kmp_output_program *o, int most)
{
    static const kmp_output_kind order[KMP_OUTPUT_KINDS] = {KMP_OUTPUT_Q,
                                                            KMP_OUTPUT_QD,
                                                            KMP_OUTPUT_QDD,
                                                            KMP_OUTPUT_CUT_Q,
                                                            KMP_OUTPUT_CUT_QD,
                                                            KMP_OUTPUT_CUT_QDD,
                                                            KMP_OUTPUT_STATE,
                                                            KMP_OUTPUT_ENERGY,
                                                            KMP_OUTPUT_SENSOR,
                                                            KMP_OUTPUT_FORCE,
                                                            KMP_OUTPUT_GAP,
                                                            KMP_OUTPUT_OUTLINE_FORCE,
                                                            KMP_OUTPUT_OUTLINE_GAP,
                                                            KMP_OUTPUT_CAM_FORCE,
                                                            KMP_OUTPUT_PRESSURE_ANGLE,
                                                            KMP_OUTPUT_CURVATURE,
                                                            KMP_OUTPUT_TOUCH_PRESSURE_ANGLE,
                                                            KMP_OUTPUT_TOUCH_CURVATURE,
                                                            KMP_OUTPUT_TENSION,
                                                            KMP_OUTPUT_ROPE_LENGTH,
                                                            KMP_OUTPUT_WRAP,
                                                            KMP_OUTPUT_LAMBDA,
                                                            KMP_OUTPUT_REACTION,
                                                            KMP_OUTPUT_MOMENT,
                                                            KMP_OUTPUT_JOINT_REACTION,
                                                            KMP_OUTPUT_JOINT_MOMENT,
                                                            KMP_OUTPUT_BEARING,
                                                            KMP_OUTPUT_POSITION,
                                                            KMP_OUTPUT_VELOCITY,
                                                            KMP_OUTPUT_ACCELERATION,
                                                            KMP_OUTPUT_DEFLECTION,
                                                            KMP_OUTPUT_SECTION,
                                                            KMP_OUTPUT_STRAINED,
                                                            KMP_OUTPUT_STRESS,
                                                            KMP_OUTPUT_CONTACT,
                                                            KMP_OUTPUT_GUIDANCE,
                                                            KMP_OUTPUT_TYRE_CONTACT,
                                                            KMP_OUTPUT_POSE,
                                                            KMP_OUTPUT_MOMENTUM,
                                                            KMP_OUTPUT_ANGULAR_MOMENTUM,
                                                            KMP_OUTPUT_ANGULAR_VELOCITY,
                                                            KMP_OUTPUT_AXES};
    kempe_model *model = kmp_variant_model(o->variant);
    int room = model->output_count + 8 + model->sensor_count + 2 * model->force_count + 2 * model->closure_count +
               3 * model->cut_coordinate_count + 7 * model->point_count + 3 * model->wheel_count + model->tyre_count +
               2 * model->rope_count;
    listing l = {.model = model, .list = KMP_ARENA_NEW(&model->arena, kmp_output, room), .most = most};
    KMP_TRY(kmp_made(model->context, l.list));
    for (int k = 0; k < model->output_count; k++)
        add(&l, model->outputs[k], true);
    for (int k = 0; k < KMP_OUTPUT_KINDS; k++)
        list_kind(&l, order[k]);
    model->outputs = l.list;
    model->output_count = l.count;
    o->left_out = l.left_out;
    return KEMPE_OK;
}

/* -- the program ------------------------------------------------------------------------------------- */

static kmp_ref *values_of(const kmp_output_program *o, const kmp_equations *eq)
{
    static const kmp_input_kind kind[] = {[KMP_QUANTITY_Q] = KMP_IN_Q,
                                          [KMP_QUANTITY_QD] = KMP_IN_QD,
                                          [KMP_QUANTITY_QDD] = KMP_IN_QDD,
                                          [KMP_QUANTITY_LAMBDA] = KMP_IN_LAMBDA};
    kmp_ref *value = KMP_GRAPH_NEW(eq->graph, kmp_ref, o->columns.count);
    for (int c = 1; value && c < o->columns.count; c++) {
        const kmp_column *of = &o->columns.of[c];
        value[c - 1] = of->quantity == KMP_QUANTITIES ? eq->outputs.shown[of->index]
                                                      : kmp_input(eq->graph, kind[of->quantity], (uint32_t)of->index);
    }
    return value;
}

/* -- observing --------------------------------------------------------------------------------------- */

static kempe_status make(kmp_output_program *o, const char *words, int most, const kmp_output_program_stages *more)
{
    unsigned *parts = NULL;
    KMP_TRY(kmp_variant_new(o->system->model, 0, NULL, &o->variant));
    kempe_model *copy = kmp_variant_model(o->variant);
    KMP_TRY(words ? kmp_requested_outputs(copy, words, &parts) : list_all(o, most));
    if (!kmp_columns_init(&o->columns, o->system, copy, parts))
        return KEMPE_E_MEMORY;
    /* Rows h are derived too: their multipliers may be part of outputs. */
    const kmp_derivation_request scene = {
        .sets = KMP_SET_OUTPUT | KMP_SET_CLOSURE | (more ? KMP_SET_JDQD : 0), .plain = true, .keep_modes = true};
    kmp_equations eq;
    KMP_TRY(kmp_equations_derive_once(&eq, kmp_variant_model(o->variant), &scene));
    int count = o->columns.count - 1, counts[1 + OBSERVED_ADDED] = {count};
    const unsigned late = 1u << KMP_IN_QDD | 1u << KMP_IN_LAMBDA;
    const kmp_ref *value = values_of(o, &eq), *groups[1 + OBSERVED_ADDED] = {value};
    for (int i = 0; value && i < count; i++)
        o->late = o->late || kmp_graph_node(eq.graph, kmp_id(value[i]))->depends & late;
    if (value && more)
        more->make(more->user, &eq, count, value, counts + 1, groups + 1);
    if (!kmp_graph_failed(eq.graph))
        o->program = kmp_program_new(eq.graph, more ? 1 + OBSERVED_ADDED : 1, counts, groups);
    o->machine = o->program ? kmp_machine_new(o->program, kmp_backend_find(kmp_backend_default())) : NULL;
    kempe_status status = o->machine ? KEMPE_OK : KEMPE_E_MEMORY;
    kmp_equations_free(&eq);
    KMP_TRY(status);
    o->zero = KMP_ARENA_NEW(&o->arena, double, o->system->n + o->system->m);
    if (!kmp_present_inputs_init(&o->inputs, &o->arena, o->system->model) || o->arena.failed)
        return KEMPE_E_MEMORY;
    o->inputs.before = true;
    kmp_machine_set(o->machine, KMP_IN_PARAMETER, o->system->parameters);
    (void)kmp_machine_run(o->machine, 0);
    return KEMPE_OK;
}

kempe_status kmp_output_program_init(kmp_output_program *observed, const kempe_system *system, const char *words,
                                     int most, const kmp_output_program_stages *more)
{
    *observed = (kmp_output_program){.system = system};
    kempe_status status = make(observed, words, most, more);
    if (status != KEMPE_OK)
        kmp_output_program_free(observed);
    return status == KEMPE_E_MEMORY ? kmp_fail_memory(system->context) : status;
}

KMP_CLEARS(kmp_output_program, observed, kmp_machine_free(observed->machine), kmp_program_free(observed->program),
           kmp_columns_free(&observed->columns), kmp_variant_free(observed->variant), kmp_arena_free(&observed->arena))

/* Sets a state (NULL: zero) with its inputs. */
static void output_program_place(kmp_output_program *o, double t, const double *q, const double *qd, const double *qdd,
                                 const double *lambda)
{
    kmp_machine_set(o->machine, KMP_IN_TIME, kmp_present_inputs_at(&o->inputs, t));
    kmp_machine_set(o->machine, KMP_IN_Q, q);
    kmp_machine_set(o->machine, KMP_IN_QD, qd ? qd : o->zero);
    kmp_machine_set(o->machine, KMP_IN_QDD, qdd ? qdd : o->zero);
    kmp_machine_set(o->machine, KMP_IN_LAMBDA, lambda ? lambda : o->zero);
}

void kmp_output_program_at(kmp_output_program *o, double t, const double *q, const double *qd, const double *qdd,
                           const double *lambda, double *values)
{
    output_program_place(o, t, q, qd, qdd, lambda);
    memcpy(values, kmp_machine_run(o->machine, OBSERVED_VALUES), (size_t)(o->columns.count - 1) * sizeof *values);
}

void kmp_output_program_fill(kmp_output_program *o, const kmp_samples *samples, int row, double *values)
{
    values[0] = kmp_samples_time(samples, row);
    kmp_output_program_at(o, kmp_samples_instant(samples, row), kmp_samples_get(samples, KMP_QUANTITY_Q, row),
                          kmp_samples_get(samples, KMP_QUANTITY_QD, row),
                          kmp_samples_get(samples, KMP_QUANTITY_QDD, row),
                          kmp_samples_get(samples, KMP_QUANTITY_LAMBDA, row), values + 1);
}

/* Stages of the program beyond the values: J by columns and jdqd; jdqd of the closures. */
enum { SLOPES = OBSERVED_MORE, CLOSURES };

/* -- outputs by handle ----------------------------------------------------------------------------------- */

/* Outputs by handle: one program with the values, their Jacobian and its product with the rates. The closed-chain
 * Jacobian takes the tangent of coordinate partitioning (Fisette and Samin 1996, eq. 43). */

struct kempe_outputs {
    const kempe_system *system;
    kmp_arena arena;
    kmp_output_program observed;
    int n, m, count;
    bool *moves;         /* of each value: it has a Jacobian */
    kmp_evaluator *eval; /* of the closures, for the tangent */
    kmp_partition part;
    kmp_reduction red;
    bool reduces;  /* `red` is there */
    double *rate;  /* n */
    double *slope; /* count x n, and count: J and jdqd */
};

/* J by q, of outputs that depend on rates by qd; jdqd is the second, or the first, total derivative by time. */
static void differentiate(kempe_outputs *o, const kmp_equations *eq, int count, const kmp_ref *value, kmp_ref *slope)
{
    kmp_graph *g = eq->graph;
    const unsigned late = 1u << KMP_IN_QDD | 1u << KMP_IN_LAMBDA;
    kmp_derivative *d = kmp_time_derivative(&eq->tree);
    kmp_ref *by = KMP_GRAPH_NEW(g, kmp_ref, 2 * count * o->n);
    if (!by)
        return;
    kmp_ref *by_rates = by + count * o->n;
    kmp_partials_all(g, count, value, KMP_IN_Q, o->n, by);
    kmp_partials_all(g, count, value, KMP_IN_QD, o->n, by_rates);
    for (int i = 0; i < count; i++) {
        unsigned depends = kmp_graph_node(g, kmp_id(value[i]))->depends;
        bool rates = depends & 1u << KMP_IN_QD;
        o->moves[i] = !(depends & late);
        kmp_ref rate = rates ? value[i] : kmp_derivative_of(d, value[i]);
        for (int k = 0; k < o->n && o->moves[i]; k++)
            slope[k * count + i] = (rates ? by_rates : by)[i * o->n + k];
        slope[o->n * count + i] = o->moves[i] ? kmp_derivative_of(d, rate) : KMP_ZERO;
    }
    kmp_derivative_free(d);
}

static void make_slopes(void *user, const kmp_equations *eq, int count, const kmp_ref *value, int *counts,
                        const kmp_ref **groups)
{
    kempe_outputs *o = user;
    kmp_ref *slope = KMP_GRAPH_NEW(eq->graph, kmp_ref, count * (o->n + 1));
    o->count = count;
    o->moves = KMP_ARENA_NEW(&o->arena, bool, count);
    if (slope && o->moves)
        differentiate(o, eq, count, value, slope);
    counts[0] = count * (o->n + 1);
    groups[0] = slope;
    counts[1] = o->m;
    groups[1] = eq->closures.jdqd;
}

/* -- new and free ------------------------------------------------------------------------------------ */

/* Chooses the independent coordinates at the start, `count` of them the caller's; a choice that fails changes nothing.
 */
static kempe_status choose(kempe_outputs *o, const int *u, int count)
{
    kmp_partition part = {0};
    kempe_assembly *a = NULL;
    KMP_TRY(kmp_assembly_at_start(o->system, &a));
    kmp_eval_closure(o->eval, 0, kempe_assembly_q(a));
    kempe_assembly_free(a);
    kempe_status status = kmp_partition_init(&part, o->system, o->eval->jacobian, count ? u : NULL, count);
    if (status != KEMPE_OK) {
        kmp_partition_free(&part);
        return status;
    }
    if (o->reduces)
        kmp_reduction_free(&o->red);
    kmp_partition_free(&o->part);
    o->part = part;
    status = kmp_reduction_init(&o->red, o->eval, &o->part);
    o->reduces = status == KEMPE_OK;
    return status;
}

static kempe_status make_output_values(kempe_outputs *o, const char *words)
{
    const kmp_output_program_stages slopes = {o, make_slopes};
    KMP_TRY(kmp_output_program_init(&o->observed, o->system, words, 0, &slopes));
    o->eval = kmp_eval_new_of_closures(o->system);
    o->rate = KMP_ARENA_NEW(&o->arena, double, o->n);
    o->slope = KMP_ARENA_NEW(&o->arena, double, o->count *(o->n + 1));
    if (!o->eval || o->arena.failed)
        return KEMPE_E_MEMORY;
    /* The choice at the start; none where it cannot be assembled: closed-chain Jacobians are then refused. */
    kempe_status status = choose(o, NULL, 0);
    KMP_TRY(status == KEMPE_E_MEMORY ? status : KEMPE_OK);
    kmp_context_clear(o->system->context);
    return KEMPE_OK;
}

kempe_status kempe_outputs_new(const kempe_system *system, const char *words, kempe_outputs **outputs)
{
    KMP_WANTED_BOTH(system, words);
    KMP_WANTED(system->context, outputs, "outputs");
    kmp_model_begin(system->model);
    KMP_MAKE(system->context, kempe_outputs, o);
    o->system = system;
    o->n = system->n;
    o->m = system->m;
    kempe_status status = make_output_values(o, words);
    if (status == KEMPE_E_MEMORY)
        (void)kmp_fail_memory(system->context);
    return KMP_GIVE_OR_FREE(status, outputs, o, kempe_outputs_free);
}

KMP_FREES(kempe_outputs, o, kmp_reduction_free(&o->red), kmp_partition_free(&o->part), kmp_eval_free(o->eval),
          kmp_output_program_free(&o->observed), kmp_arena_free(&o->arena))

/* -- names ------------------------------------------------------------------------------------------- */

KMP_GETTER(int kempe_outputs_count(const kempe_outputs *outputs), outputs, outputs->count, 0)
KMP_GETTER_AT(const char *kempe_outputs_name(const kempe_outputs *outputs, int k), outputs, k, outputs->count,
              outputs->observed.columns.name[k + 1], NULL)
KMP_GETTER_AT(const char *kempe_outputs_unit(const kempe_outputs *outputs, int k), outputs, k, outputs->count,
              outputs->observed.columns.unit[k + 1], "")

int kempe_outputs_find(const kempe_outputs *outputs, const char *name)
{
    for (int k = 0; name && k < kempe_outputs_count(outputs); k++)
        if (strcmp(kempe_outputs_name(outputs, k), name) == 0)
            return k;
    return -1;
}

/* -- values ------------------------------------------------------------------------------------------ */

kempe_status kempe_outputs_at_state(kempe_outputs *o, double t, const double *q, const double *qd, const double *qdd,
                                    const double *lambda, double *values)
{
    KMP_WANTED(NULL, o, "outputs");
    KMP_WANTED(o->system->context, q, "q");
    KMP_WANTED(o->system->context, values, "values");
    kmp_output_program_at(&o->observed, t, q, qd, qdd, lambda, values);
    return KEMPE_OK;
}

static kempe_status check_system(const kempe_outputs *o, const kempe_system *system)
{
    if (system == o->system)
        return KEMPE_OK;
    kmp_context_clear(o->system->context);
    return kmp_fail(o->system->context, KEMPE_E_ARGUMENT, "the outputs belong to another system");
}

bool kmp_outputs_are_late(const kempe_outputs *o)
{
    return o->observed.late;
}

void kmp_outputs_with_inputs(kempe_outputs *o, const kmp_present_inputs *given, double t, const double *row,
                             double *values)
{
    kmp_present_inputs *inputs = &o->observed.inputs;
    const int n = o->system->n;
    kmp_present_inputs_copy(inputs, given);
    inputs->held = true;
    kmp_output_program_at(&o->observed, t, row, row + n, row + 2 * n, row + 3 * n, values);
    kmp_present_inputs_take_samples(inputs);
    inputs->held = false;
}

kempe_status kempe_outputs_at_stepper(kempe_outputs *o, const kempe_stepper *s, double *values)
{
    KMP_WANTED(NULL, o, "outputs");
    KMP_WANTED(o->system->context, s, "stepper");
    KMP_WANTED(o->system->context, values, "values");
    KMP_TRY(check_system(o, s->system));
    kmp_outputs_with_inputs(o, kmp_runner_inputs(s->runner), s->t, s->row, values);
    return KEMPE_OK;
}

kempe_status kempe_outputs_at_row(kempe_outputs *o, const kempe_trajectory *t, int row, double *values)
{
    KMP_WANTED(NULL, o, "outputs");
    KMP_WANTED(o->system->context, t, "trajectory");
    KMP_WANTED(o->system->context, values, "values");
    KMP_TRY(check_system(o, t->system));
    kmp_context_clear(o->system->context);
    if (row < 0 || row >= kempe_trajectory_row_count(t))
        return kmp_fail(o->system->context, KEMPE_E_ARGUMENT, "there is no row %d: the trajectory has %d", row,
                        kempe_trajectory_row_count(t));
    return kempe_outputs_at_state(o, kempe_trajectory_time(t, row), kempe_trajectory_q(t, row),
                                  kempe_trajectory_qd(t, row), kempe_trajectory_qdd(t, row),
                                  kempe_trajectory_lambda(t, row), values);
}

kempe_status kempe_outputs_at_time(kempe_outputs *outputs, kempe_trajectory *trajectory, double t, double *values)
{
    KMP_WANTED(NULL, outputs, "outputs");
    KMP_WANTED(NULL, trajectory, "trajectory");
    KMP_TRY(check_system(outputs, trajectory->system));
    const double *row = trajectory->at;
    int n = trajectory->system->n;
    KMP_TRY(kempe_trajectory_at_time(trajectory, t, NULL, NULL, NULL, NULL));
    return kempe_outputs_at_state(outputs, t, row, row + n, row + 2 * n, row + 3 * n, values);
}

/* -- Jacobians --------------------------------------------------------------------------------------- */

kempe_status kempe_outputs_jacobian(kempe_outputs *o, double t, const double *q, const double *qd, double *jacobian,
                                    double *jdqd)
{
    KMP_WANTED(NULL, o, "outputs");
    KMP_WANTED(o->system->context, q, "q");
    KMP_WANTED(o->system->context, jacobian, "jacobian");
    /* J and jdqd at a state, owned by the machine. */
    output_program_place(&o->observed, t, q, qd, NULL, NULL);
    (void)kmp_machine_run(o->observed.machine, OBSERVED_VALUES);
    const double *slope = kmp_machine_run(o->observed.machine, SLOPES);
    for (int k = 0; k < o->n * o->count; k++)
        jacobian[k] = o->moves[k % o->count] ? slope[k] : NAN;
    for (int i = 0; jdqd && i < o->count; i++)
        jdqd[i] = o->moves[i] ? slope[o->n * o->count + i] : NAN;
    return KEMPE_OK;
}

kempe_status kempe_outputs_choose(kempe_outputs *o, const char *independent)
{
    KMP_WANTED(NULL, o, "outputs");
    kempe_context *context = o->system->context;
    kmp_model_begin(o->system->model);
    int count = 0, *u = KMP_NEW(int, o->n);
    kempe_status status =
        u ? kmp_coordinates_read(o->system->model, "independent", independent, u, &count) : kmp_fail_memory(context);
    if (status == KEMPE_OK)
        status = choose(o, u, count);
    kmp_free(u);
    return status;
}

KMP_GETTER(int kempe_outputs_independent_count(const kempe_outputs *outputs), outputs, outputs->part.p, 0)
KMP_GETTER(const int *kempe_outputs_independent(const kempe_outputs *outputs), outputs, outputs->part.u, NULL)

/* X and x_t at a closed position; at a dead centre its coordinates by name. */
static kempe_status find_tangent(kempe_outputs *o, double t, const double *q)
{
    const kempe_model *model = o->system->model;
    kempe_context *context = o->system->context;
    int v = 0, u = 0;
    if (!o->reduces)
        return kmp_fail(context, KEMPE_E_FAILED, "independent coordinates cannot be chosen at the start of the model");
    kmp_eval_closure(o->eval, t, q);
    if (!(kmp_eval_residual(o->eval) <= KMP_CLOSED_NEAR))
        return kmp_fail(context, KEMPE_E_FAILED,
                        "a Jacobian of closed motions needs closed loops, but they are open by %.3g (relative) at t = "
                        "%.9g s: close the state first",
                        kmp_eval_residual(o->eval), t);
    int singular = kmp_reduction_factor(&o->red);
    if (singular > 0)
        return kmp_fail(context, KEMPE_E_FAILED,
                        "the closures are singular at t = %.9g s: the independent coordinates do not determine '%s' "
                        "(a dead centre)",
                        t, model->motions[singular - 1].name);
    kmp_reduction_tangent(&o->red);
    double growth = o->part.p > 0 ? kmp_reduction_growth(&o->red, &v, &u) : 0;
    if (growth <= KMP_TANGENT_SINGULAR)
        return KEMPE_OK;
    return kmp_fail(
        context, KEMPE_E_FAILED,
        "'%s' is at a dead centre at t = %.9g s: it stops while '%s' moves (rates by a factor %.2g); choose "
        "other independent coordinates",
        model->motions[u].name, t, model->motions[v].name, growth);
}

kempe_status kempe_outputs_closed_jacobian(kempe_outputs *o, double t, const double *q, const double *qd,
                                           double *jacobian, double *drift)
{
    KMP_WANTED(NULL, o, "outputs");
    KMP_WANTED(o->system->context, q, "q");
    KMP_WANTED(o->system->context, jacobian, "jacobian");
    kmp_context_clear(o->system->context);
    KMP_TRY(find_tangent(o, t, q));
    int n = o->n, p = o->part.p;
    const double *x = o->red.x;
    KMP_TRY(kempe_outputs_jacobian(o, t, q, qd, o->slope, o->slope + n * o->count));
    for (int k = 0; k < p; k++)
        for (int i = 0; i < o->count; i++) {
            double sum = 0;
            for (int j = 0; j < n; j++)
                sum += o->slope[j * o->count + i] * x[k * n + j];
            jacobian[k * o->count + i] = sum;
        }
    /* J a0 + jdqd with a0 = (0; -Jv^-1 jdqd of the closures): the accelerations at udd = 0. */
    if (drift) {
        memset(o->rate, 0, (size_t)n * sizeof *o->rate);
        if (o->m > 0)
            kmp_reduction_push_in(&o->red, -1, kmp_machine_run(o->observed.machine, CLOSURES), o->red.room, o->rate);
        for (int i = 0; i < o->count; i++) {
            drift[i] = o->slope[n * o->count + i];
            for (int k = 0; k < n; k++)
                drift[i] += o->slope[k * o->count + i] * o->rate[k];
        }
    }
    return KEMPE_OK;
}
