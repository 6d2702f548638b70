/* SPDX-License-Identifier: BSD-3-Clause */
/* A trajectory as CSV: time, then what the model's outputs ask for, in their order. */
#include "base/memory.h"
#include "model/output_table.h"
#include "results/trajectory.h"
#include <math.h>

/* Of an output whose values are in the table. */
static kmp_quantity quantity_of(kmp_output_kind kind)
{
    return kind == KMP_OUTPUT_Q     ? KMP_QUANTITY_Q
           : kind == KMP_OUTPUT_QD  ? KMP_QUANTITY_QD
           : kind == KMP_OUTPUT_QDD ? KMP_QUANTITY_QDD
                                    : KMP_QUANTITY_LAMBDA;
}

/* lambda(CLOSURE) asks for that closure's rows alone, q(JOINT) for that coordinate. */
static bool is_asked(const kempe_system *system, const kmp_output *output, int k)
{
    if (output->index < 0)
        return true;
    return output->kind == KMP_OUTPUT_LAMBDA ? system->rows[k].closure == output->index : k == output->index;
}

static bool same_output(const kmp_output *a, const kmp_output *b)
{
    return a->kind == b->kind && a->index == b->index;
}

/* An output that was asked for twice, or one of those where all are there already, is no second column. */
static bool is_repeated(const kempe_model *model, int output)
{
    const kmp_output *o = &model->outputs[output];
    for (int k = 0; k < model->output_count; k++) {
        const kmp_output *other = &model->outputs[k];
        if (k < output && same_output(other, o))
            return true;
        if (k != output && o->kind == other->kind && o->index >= 0 && other->index < 0)
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
        for (int k = 0; k < kmp_output_rows[output->kind].width; k++) {
            kmp_text_put(text, ",");
            kmp_output_column(text, model, output, k);
        }
        if (kmp_output_rows[output->kind].width > 0)
            continue;
        kmp_quantity quantity = quantity_of(output->kind);
        for (int k = 0; k < kmp_quantity_size(system, quantity); k++)
            if (is_asked(system, output, k))
                kmp_text_printf(text, ",%s.%s", kmp_quantity_prefix(quantity), kmp_quantity_name(system, quantity, k));
    }
    kmp_text_put(text, "\n");
}

/* `shown`: what outputs show beside the table. */
static void write_row(kmp_text *text, const kempe_trajectory *t, int row, const double *shown)
{
    const kempe_model *model = t->system->model;
    kmp_text_number(text, kmp_samples_time(&t->table, row));
    for (int o = 0; o < model->output_count; o++) {
        const kmp_output *output = &model->outputs[o];
        int width = kmp_output_rows[output->kind].width;
        const double *x = shown;
        shown += width;
        if (is_repeated(model, o))
            continue;
        for (int k = 0; k < width; k++)
            write_number(text, x[k]);
        if (width > 0)
            continue;
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
    for (int row = 0; row < trajectory->table.rows; row++)
        write_row(&text, trajectory, row, kmp_trajectory_shown(trajectory, plant, row));
    kmp_plant_free(plant);
    char *whole = kmp_text_take(&text);
    if (!whole)
        return kmp_fail_memory(system->context);
    kempe_status status = kempe_write_file(system->context, path, whole);
    kmp_free(whole);
    return status;
}
