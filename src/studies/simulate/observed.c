/* SPDX-License-Identifier: BSD-3-Clause */
#include "studies/simulate/observed.h"
#include "constraints/rounding/mend.h"
#include "model/tables/output_table.h"
#include "model/tables/requested.h"

/* -- all outputs of a model -------------------------------------------------------------------------- */

/* The list under construction. Outputs of which a quantity is complete are not counted. */
typedef struct listing {
    kempe_model *model;
    kmp_output *list;
    int count, columns, most, left_out;
} listing;

static bool is_listed(const listing *l, const kmp_output *output)
{
    for (int k = 0; k < l->count; k++)
        if (kmp_output_includes(&l->list[k], output))
            return true;
    return false;
}

static int width_of(const kempe_model *model, const kmp_output *output)
{
    int width = kmp_output_width(model, output);
    return width > 0 ? width : output->index < 0 ? model->motion_count : 1;
}

static void add(listing *l, kmp_output output, bool wanted)
{
    int columns = width_of(l->model, &output);
    if (is_listed(l, &output))
        return;
    if (!wanted && l->columns + columns > l->most) {
        l->left_out++;
        return;
    }
    l->columns += columns;
    l->list[l->count++] = output;
}

/* Drives have no reaction between bodies; a force that is given by its components has no value of its own. */
static bool has_output(const kempe_model *model, kmp_output_kind kind, int index)
{
    bool of_loop = kmp_output_rows[kind].argument == KMP_OUTPUT_OF_LOOP;
    if (of_loop)
        return !kmp_closure_is_drive(&model->closures[index]);
    if (kmp_output_rows[kind].argument == KMP_OUTPUT_OF_POINT)
        return model->points[index].body > 0; /* points of the ground rest */
    return kind != KMP_OUTPUT_FORCE ||
           !(model->forces[index].vector[0] || model->forces[index].kind == KMP_FORCE_STATE);
}

/* The kinds in the order of their rows, with the words that a reader looks for first before those of points. */
static void list_kind(listing *l, kmp_output_kind kind)
{
    const kempe_model *model = l->model;
    if (kind == KMP_OUTPUT_STATE && model->state_count == 0)
        return;
    if (kmp_output_stands_alone(kind)) {
        kmp_output all = {.kind = kind, .index = -1};
        add(l, all, false);
        return;
    }
    int count = kmp_output_names(model, kmp_output_rows[kind].argument).count;
    for (int k = 0; k < count; k++) {
        kmp_output one = {.kind = kind, .index = k};
        if (has_output(model, kind, k))
            add(l, one, false);
    }
}

static kempe_status list_all(kmp_observed *o, int most)
{
    static const kmp_output_kind order[] = {KMP_OUTPUT_Q,
                                            KMP_OUTPUT_QD,
                                            KMP_OUTPUT_QDD,
                                            KMP_OUTPUT_STATE,
                                            KMP_OUTPUT_ENERGY,
                                            KMP_OUTPUT_SENSOR,
                                            KMP_OUTPUT_FORCE,
                                            KMP_OUTPUT_LAMBDA,
                                            KMP_OUTPUT_REACTION,
                                            KMP_OUTPUT_MOMENT,
                                            KMP_OUTPUT_POSITION,
                                            KMP_OUTPUT_VELOCITY,
                                            KMP_OUTPUT_ACCELERATION,
                                            KMP_OUTPUT_CONTACT,
                                            KMP_OUTPUT_MOMENTUM,
                                            KMP_OUTPUT_ANGULAR_MOMENTUM,
                                            KMP_OUTPUT_ANGULAR_VELOCITY,
                                            KMP_OUTPUT_AXES};
    kempe_model *model = kmp_variant_model(o->variant);
    int room = model->output_count + 8 + model->sensor_count + model->force_count + 2 * model->closure_count +
               5 * model->point_count + model->wheel_count;
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

/* -- observing --------------------------------------------------------------------------------------- */

static kempe_status make(kmp_observed *o, const kempe_system *system, const char *words, int most, const char *backend)
{
    KMP_TRY(kmp_variant_new(system->model, 0, NULL, &o->variant));
    KMP_TRY(words ? kmp_requested_outputs(kmp_variant_model(o->variant), words, &o->parts) : list_all(o, most));
    KMP_TRY(kmp_system_of_variant(o->variant, &o->system));
    kempe_system_set_force(o->system, system->force, system->force_user);
    o->eval = kmp_eval_new(o->system, backend);
    if (!o->eval)
        return KEMPE_E_MEMORY;
    return kmp_columns_init(&o->columns, o->system) ? KEMPE_OK : kmp_fail_memory(system->context);
}

kempe_status kmp_observed_init(kmp_observed *observed, const kempe_system *system, const char *words, int most,
                               const char *backend)
{
    *observed = (kmp_observed){0};
    kempe_status status = make(observed, system, words, most, backend);
    if (status != KEMPE_OK)
        kmp_observed_free(observed);
    return status;
}

void kmp_observed_free(kmp_observed *observed)
{
    kmp_columns_free(&observed->columns);
    kmp_eval_free(observed->eval);
    kempe_system_free(observed->system);
    kmp_variant_free(observed->variant);
    *observed = (kmp_observed){0};
}

void kmp_observed_fill(const kmp_observed *o, const kmp_samples *samples, int row, double *values)
{
    kmp_columns_fill(samples, &o->columns, o->eval, row, values);
}

bool kmp_observed_has(const kmp_observed *o, int column)
{
    const kmp_column *of = &o->columns.of[column];
    return of->output < 0 || !o->parts || o->parts[of->output] >> of->component & 1u;
}
