/* SPDX-License-Identifier: BSD-3-Clause */
#include "studies/simulate/columns.h"
#include "base/memory.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include "output/print.h"

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

/* -- the columns ------------------------------------------------------------------------------------- */

static void add(kmp_columns *columns, kmp_text *name, const char *unit, kmp_column of)
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
        /* Components beyond the bits have no words of their own. */
        if (parts && k < 32 && !(parts[o] >> k & 1u))
            continue;
        kmp_output_column(&name, model, output, k);
        add(columns, &name, kmp_output_unit(model, output, k), (kmp_column){KMP_QUANTITIES, first + k, o, k});
    }
}

static void add_from_table(kmp_columns *columns, const kempe_system *system, const kempe_model *model, int o)
{
    const kmp_output *output = &model->outputs[o];
    kmp_quantity quantity = quantity_of(output->kind);
    for (int k = 0; k < kmp_quantity_size(system, quantity); k++) {
        kmp_text name = {0};
        /* lambda(CLOSURE) has that closure's rows alone, q(JOINT) that coordinate. */
        if (output->index >= 0 && (output->kind == KMP_OUTPUT_LAMBDA ? system->rows[k].closure : k) != output->index)
            continue;
        kmp_text_printf(&name, "%s.%s", kmp_quantity_prefix(quantity), kmp_quantity_name(system, quantity, k));
        /* A state is the rate of its motion. */
        bool state = quantity == KMP_QUANTITY_STATE;
        int index = state ? kmp_model_coordinates(system->model) + k : k;
        add(columns, &name, kmp_quantity_unit(system, quantity, k),
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
        add(columns, &time, "s", (kmp_column){KMP_QUANTITIES, -1, -1, 0});
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
