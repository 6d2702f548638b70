/* SPDX-License-Identifier: BSD-3-Clause */
/* A trajectory as CSV: time, then what the model's outputs ask for, in their order. */
#include "base/memory.h"
#include "results/trajectory.h"
#include <math.h>

static kmp_quantity quantity_of(kmp_output_kind kind)
{
    switch (kind) {
    case KMP_OUTPUT_Q:
        return KMP_QUANTITY_Q;
    case KMP_OUTPUT_QD:
        return KMP_QUANTITY_QD;
    case KMP_OUTPUT_QDD:
        return KMP_QUANTITY_QDD;
    case KMP_OUTPUT_LAMBDA:
    case KMP_OUTPUT_POSITION:
        break;
    }
    return KMP_QUANTITY_LAMBDA;
}

/* lambda(CLOSURE) asks for that closure's rows alone. */
static bool is_asked(const kempe_system *system, const kmp_output *output, int k)
{
    return output->kind != KMP_OUTPUT_LAMBDA || output->index < 0 || system->rows[k].closure == output->index;
}

static bool same_output(const kmp_output *a, const kmp_output *b)
{
    return a->kind == b->kind && a->index == b->index;
}

/* An output that was asked for twice, or a closure's lambda where all are there already, is no second column. */
static bool is_repeated(const kempe_model *model, int output)
{
    const kmp_output *o = &model->outputs[output];
    for (int k = 0; k < model->output_count; k++) {
        const kmp_output *other = &model->outputs[k];
        if (k < output && same_output(other, o))
            return true;
        if (k != output && o->kind == KMP_OUTPUT_LAMBDA && other->kind == KMP_OUTPUT_LAMBDA && o->index >= 0 &&
            other->index < 0)
            return true;
    }
    return false;
}

static void write_number(kmp_text *text, double x)
{
    kmp_text_put(text, ",");
    if (isfinite(x))
        kmp_text_number(text, x);
}

static void write_header(kmp_text *text, const kempe_system *system)
{
    const kempe_model *model = system->model;
    kmp_text_put(text, "t");
    for (int o = 0; o < model->output_count; o++) {
        const kmp_output *output = &model->outputs[o];
        if (is_repeated(model, o))
            continue;
        if (output->kind == KMP_OUTPUT_POSITION) {
            const kmp_point *p = &model->points[output->index];
            for (int k = 0; k < 3; k++)
                kmp_text_printf(text, ",position.%s.%s.%c", model->bodies[p->body].name, p->name, "xyz"[k]);
            continue;
        }
        kmp_quantity quantity = quantity_of(output->kind);
        for (int k = 0; k < kmp_quantity_size(system, quantity); k++)
            if (is_asked(system, output, k))
                kmp_text_printf(text, ",%s.%s", kmp_quantity_prefix(quantity), kmp_quantity_name(system, quantity, k));
    }
    kmp_text_put(text, "\n");
}

/* `position`: 3 values a position output, NULL when there is none. */
static void write_row(kmp_text *text, const kempe_trajectory *t, int row, const double *position)
{
    const kempe_model *model = t->system->model;
    kmp_text_number(text, kmp_samples_time(&t->table, row));
    for (int o = 0; o < model->output_count; o++) {
        const kmp_output *output = &model->outputs[o];
        const double *x = position;
        if (output->kind == KMP_OUTPUT_POSITION)
            position += 3;
        if (is_repeated(model, o))
            continue;
        if (output->kind == KMP_OUTPUT_POSITION) {
            for (int k = 0; k < 3; k++)
                write_number(text, x[k]);
            continue;
        }
        kmp_quantity quantity = quantity_of(output->kind);
        const double *value = kmp_samples_get(&t->table, quantity, row);
        for (int k = 0; k < kmp_quantity_size(t->system, quantity); k++)
            if (is_asked(t->system, output, k))
                write_number(text, value[k]);
    }
    kmp_text_put(text, "\n");
}

kempe_status kempe_trajectory_write_csv(const kempe_trajectory *trajectory, const char *path)
{
    const kempe_system *system = trajectory->system;
    kmp_context_clear(system->context);
    kmp_plant *plant = kmp_plant_new(system, trajectory->backend);
    if (!plant)
        return KEMPE_E_MEMORY;
    kmp_text text = {0};
    write_header(&text, system);
    for (int row = 0; row < trajectory->table.rows; row++) {
        double t = kmp_samples_time(&trajectory->table, row);
        const double *q = kmp_samples_get(&trajectory->table, KMP_QUANTITY_Q, row);
        write_row(&text, trajectory, row, kmp_plant_positions(plant, t, q));
    }
    kmp_plant_free(plant);
    char *whole = kmp_text_take(&text);
    if (!whole)
        return kmp_fail_memory(system->context);
    kempe_status status = kempe_write_file(system->context, path, whole);
    kmp_free(whole);
    return status;
}
