/* SPDX-License-Identifier: BSD-3-Clause */
#include "studies/simulate/observed.h"
#include "base/memory.h"
#include "dynamics/equations.h"
#include "model/data/closure_table.h"
#include "model/data/force_table.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include "model/read/read_outputs.h"
#include "output/print.h"
#include <string.h>

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

/* Drives have no reaction between bodies; those of joints of the tree are computed on request alone. A force that is
 * given by its components has no value of its own. */
static bool has_output(const kempe_model *model, kmp_output_kind kind, int index)
{
    bool of_loop = kmp_output_rows[kind].argument == KMP_OUTPUT_OF_LOOP;
    if (kmp_output_rows[kind].argument == KMP_OUTPUT_OF_JOINT)
        return false;
    if (of_loop)
        return !kmp_closure_is_drive(&model->closures[index]);
    if (kmp_output_rows[kind].argument == KMP_OUTPUT_OF_POINT)
        return model->points[index].body > 0; /* points of the ground rest */
    if (kind == KMP_OUTPUT_GAP)
        return model->forces[index].kind == KMP_FORCE_TOUCH;
    return kind != KMP_OUTPUT_FORCE ||
           !(kmp_force_has_components(&model->forces[index]) || model->forces[index].kind == KMP_FORCE_STATE);
}

/* The kinds in the order of their rows, with the words that a reader looks for first before those of points. */
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
    static const kmp_output_kind order[] = {KMP_OUTPUT_Q,
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
                                            KMP_OUTPUT_LAMBDA,
                                            KMP_OUTPUT_REACTION,
                                            KMP_OUTPUT_MOMENT,
                                            KMP_OUTPUT_JOINT_REACTION,
                                            KMP_OUTPUT_JOINT_MOMENT,
                                            KMP_OUTPUT_POSITION,
                                            KMP_OUTPUT_VELOCITY,
                                            KMP_OUTPUT_ACCELERATION,
                                            KMP_OUTPUT_CONTACT,
                                            KMP_OUTPUT_GUIDANCE,
                                            KMP_OUTPUT_POSE,
                                            KMP_OUTPUT_MOMENTUM,
                                            KMP_OUTPUT_ANGULAR_MOMENTUM,
                                            KMP_OUTPUT_ANGULAR_VELOCITY,
                                            KMP_OUTPUT_AXES};
    kempe_model *model = kmp_variant_model(o->variant);
    int room = model->output_count + 8 + model->sensor_count + 2 * model->force_count + 2 * model->closure_count +
               3 * model->cut_coordinate_count + 5 * model->point_count + 3 * model->wheel_count;
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
        value[c - 1] = of->quantity == KMP_QUANTITIES ? eq->shown[of->index]
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
    int count = o->columns.count - 1, counts[1 + KMP_OBSERVED_ADDED] = {count};
    const unsigned late = 1u << KMP_IN_QDD | 1u << KMP_IN_LAMBDA;
    const kmp_ref *value = values_of(o, &eq), *groups[1 + KMP_OBSERVED_ADDED] = {value};
    for (int i = 0; value && i < count; i++)
        o->late = o->late || kmp_graph_node(eq.graph, kmp_id(value[i]))->depends & late;
    if (value && more)
        more->make(more->user, &eq, count, value, counts + 1, groups + 1);
    if (!kmp_graph_failed(eq.graph))
        o->program = kmp_program_new(eq.graph, more ? 1 + KMP_OBSERVED_ADDED : 1, counts, groups);
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

void kmp_output_program_place(kmp_output_program *o, double t, const double *q, const double *qd, const double *qdd,
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
    kmp_output_program_place(o, t, q, qd, qdd, lambda);
    memcpy(values, kmp_machine_run(o->machine, KMP_OBSERVED_VALUES), (size_t)(o->columns.count - 1) * sizeof *values);
}

void kmp_output_program_fill(kmp_output_program *o, const kmp_samples *samples, int row, double *values)
{
    values[0] = kmp_samples_time(samples, row);
    kmp_output_program_at(o, values[0], kmp_samples_get(samples, KMP_QUANTITY_Q, row),
                          kmp_samples_get(samples, KMP_QUANTITY_QD, row),
                          kmp_samples_get(samples, KMP_QUANTITY_QDD, row),
                          kmp_samples_get(samples, KMP_QUANTITY_LAMBDA, row), values + 1);
}
