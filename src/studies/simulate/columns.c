/* SPDX-License-Identifier: BSD-3-Clause */
#include "studies/simulate/columns.h"
#include "base/memory.h"
#include "model/tables/output_table.h"

/* The quantity of an output whose values are in the table. */
static kmp_quantity quantity_of(kmp_output_kind kind)
{
    return kind == KMP_OUTPUT_Q     ? KMP_QUANTITY_Q
           : kind == KMP_OUTPUT_QD  ? KMP_QUANTITY_QD
           : kind == KMP_OUTPUT_QDD ? KMP_QUANTITY_QDD
                                    : KMP_QUANTITY_LAMBDA;
}

/* True if an output includes entry k: lambda(CLOSURE) has that closure's rows alone, q(JOINT) that coordinate. */
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

/* True for an output that occurs twice, or one of a quantity that is complete already: it gives no second column. */
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

/* -- units ------------------------------------------------------------------------------------------- */

const char *kmp_columns_unit_shown(kmp_output_kind kind)
{
    switch (kind) {
    case KMP_OUTPUT_POSITION:
        return "m";
    case KMP_OUTPUT_VELOCITY:
        return "m/s";
    case KMP_OUTPUT_ACCELERATION:
        return "m/s^2";
    case KMP_OUTPUT_REACTION:
        return "N";
    case KMP_OUTPUT_MOMENT:
        return "N m";
    case KMP_OUTPUT_ENERGY:
        return "J";
    default:
        return "";
    }
}

/* -- the columns ------------------------------------------------------------------------------------- */

/* The first pass counts (columns NULL), the second one names. */
typedef struct writer {
    kmp_columns *columns;
    int at;
    bool failed;
} writer;

static void add(writer *w, kmp_text *name, const char *unit, kmp_column of)
{
    int k = w->at++;
    if (w->columns) {
        w->columns->name[k] = kmp_text_take(name);
        w->columns->unit[k] = kmp_strdup(unit);
        w->columns->of[k] = of;
        w->failed = w->failed || !w->columns->name[k] || !w->columns->unit[k];
    }
    kmp_text_free(name);
}

static void add_computed(writer *w, const kempe_model *model, int o, int first)
{
    const kmp_output *output = &model->outputs[o];
    for (int k = 0; k < kmp_output_width(model, output); k++) {
        kmp_text name = {0};
        kmp_output_column(&name, model, output, k);
        add(w, &name, kmp_columns_unit_shown(output->kind), (kmp_column){KMP_QUANTITIES, first + k, o, k});
    }
}

static void add_from_table(writer *w, const kempe_system *system, int o)
{
    const kmp_output *output = &system->model->outputs[o];
    kmp_quantity quantity = quantity_of(output->kind);
    for (int k = 0; k < kmp_quantity_size(system, quantity); k++) {
        kmp_text name = {0};
        if (!is_asked(system, output, k))
            continue;
        kmp_text_printf(&name, "%s.%s", kmp_quantity_prefix(quantity), kmp_quantity_name(system, quantity, k));
        add(w, &name, kmp_quantity_unit(system, quantity, k), (kmp_column){quantity, k, o, 0});
    }
}

static void write_all(writer *w, const kempe_system *system)
{
    const kempe_model *model = system->model;
    kmp_text time = {0};
    int shown = 0;
    kmp_text_put(&time, "t");
    add(w, &time, "s", (kmp_column){KMP_QUANTITIES, -1, -1, 0});
    for (int o = 0; o < model->output_count; o++) {
        int width = kmp_output_width(model, &model->outputs[o]);
        if (!is_repeated(model, o) && width > 0)
            add_computed(w, model, o, shown);
        else if (!is_repeated(model, o))
            add_from_table(w, system, o);
        shown += width;
    }
}

bool kmp_columns_init(kmp_columns *columns, const kempe_system *system)
{
    writer count = {0}, names = {.columns = columns};
    write_all(&count, system);
    *columns = (kmp_columns){.count = count.at,
                             .name = KMP_NEW(char *, count.at),
                             .unit = KMP_NEW(char *, count.at),
                             .of = KMP_NEW(kmp_column, count.at)};
    bool room = columns->name && columns->unit && columns->of;
    if (room)
        write_all(&names, system);
    if (room && !names.failed)
        return true;
    kmp_columns_free(columns);
    return false;
}

void kmp_columns_free(kmp_columns *columns)
{
    for (int k = 0; k < columns->count; k++) {
        if (columns->name)
            kmp_free(columns->name[k]);
        if (columns->unit)
            kmp_free(columns->unit[k]);
    }
    kmp_free(columns->name);
    kmp_free(columns->unit);
    kmp_free(columns->of);
    *columns = (kmp_columns){0};
}

void kmp_columns_fill(const kempe_trajectory *t, const kmp_columns *columns, kmp_evaluator *eval, int row,
                      double *values)
{
    const double *shown = kmp_trajectory_shown(t, eval, row);
    values[0] = kmp_samples_time(&t->table, row);
    for (int k = 1; k < columns->count; k++) {
        const kmp_column *of = &columns->of[k];
        const double *from = of->quantity == KMP_QUANTITIES ? shown : kmp_samples_get(&t->table, of->quantity, row);
        values[k] = from[of->index];
    }
}
