/* SPDX-License-Identifier: BSD-3-Clause */
#include "analyses/parts/study_print.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include "model/data/variant.h"
#include "model/language/expression_value.h"
#include "output/print.h"
#include <string.h>

/* -- numbers and names --------------------------------------------------------------------------------- */

const char *kmp_quantity_unit_of(const kempe_system *system, const char *name)
{
    for (kmp_quantity quantity = KMP_QUANTITY_Q; quantity <= KMP_QUANTITY_QD; quantity++) {
        const char *prefix = kmp_quantity_prefix(quantity);
        size_t length = strlen(prefix);
        for (int k = 0;
             strncmp(name, prefix, length) == 0 && name[length] == '.' && k < kmp_model_coordinates(system->model); k++)
            if (strcmp(name + length + 1, system->model->motions[k].name) == 0)
                return kmp_quantity_unit(system, quantity, k);
    }
    const int at = kmp_parameter_find(system->model, name);
    const char *unit = at >= 0 ? system->model->parameters[at].unit : NULL;
    return unit ? unit : "";
}

kmp_shown kmp_shown_of(const kempe_system *system, const char *name)
{
    return kmp_shown_as(system->context, kmp_print_unknown(system->context, kmp_quantity_unit_of(system, name)));
}

void kmp_print_unit_of(kmp_text *text, const char *before, const kempe_system *system, const char *name)
{
    const char *unit = kmp_shown_of(system, name).unit;
    kmp_text_printf(text, "%s%s", *unit ? before : "", unit);
}

void kmp_print_value_of(kmp_text *text, const kempe_system *system, const char *name, double value)
{
    kmp_text_printf(text, "%.6g", kmp_shown_of(system, name).factor * value + 0.0);
    kmp_print_unit_of(text, " ", system, name);
}

void kmp_print_pairs(kmp_json *json, const char *key, int count, const double *re, const double *im)
{
    kmp_json_array(json, key);
    for (int k = 0; k < count; k++)
        kmp_json_numbers(json, NULL, 2, (double[]){re[k], im[k]});
    kmp_json_end(json);
}

int kmp_print_widest(int count, char *const *names, int least)
{
    int width = least;
    for (int k = 0; k < count; k++)
        width = (int)strlen(names[k]) > width ? (int)strlen(names[k]) : width;
    return width;
}

void kmp_tabulate_value(kempe_table *table, const kempe_system *system, const char *before, const char *name)
{
    kmp_tabulate_column(table, kmp_print_unknown(system->context, kmp_quantity_unit_of(system, name)), "%s%s", before,
                        name);
}

void kmp_tabulate_outputs(kempe_table *table, const kempe_model *model, const double *values)
{
    kmp_text name = {0};
    for (int o = 0, at = 0; o < model->output_count; at += kmp_output_width(model, &model->outputs[o++])) {
        const kmp_output *output = &model->outputs[o];
        bool first = true;
        for (int k = 0; k < o; k++)
            first = first && !kmp_output_equal(&model->outputs[k], output);
        for (int k = 0; first && k < kmp_output_width(model, output); k++) {
            if (values) {
                kmp_tabulate_number(table, values[at + k]);
                continue;
            }
            kmp_text_free(&name);
            kmp_output_column(&name, model, output, k);
            kmp_tabulate_column(table, kmp_output_unit(model, output, k), "%s", name.s ? name.s : "");
            if (name.failed)
                kmp_tabulate_fail(table);
        }
    }
    kmp_text_free(&name);
}

void kmp_tabulate_quantity(kempe_table *table, const kempe_system *system, kmp_quantity quantity)
{
    for (int k = 0; k < kmp_quantity_size(system, quantity); k++)
        kmp_tabulate_column(table, kmp_print_unknown(system->context, kmp_quantity_unit(system, quantity, k)), "%s.%s",
                            kmp_quantity_prefix(quantity), kmp_quantity_name(system, quantity, k));
    if (quantity == KMP_QUANTITY_QD)
        kmp_tabulate_quantity(table, system, KMP_QUANTITY_STATE);
}

void kmp_tabulate_values(kempe_table *table, const kempe_system *system, kmp_quantity quantity, const double *values)
{
    int states = quantity == KMP_QUANTITY_QD ? system->n - kmp_model_coordinates(system->model) : 0;
    kmp_tabulate_numbers(table, kmp_quantity_size(system, quantity) + states, values);
}

/* -- the state ----------------------------------------------------------------------------------------- */

/* The next held state from k on; NULL: there is none. */
static const kmp_state *next_held(const kempe_model *model, int *k)
{
    while (*k < model->state_count && !model->states[*k].held)
        ++*k;
    return *k < model->state_count ? &model->states[*k] : NULL;
}

void kmp_print_held(kmp_text *text, const char *label, const kempe_system *system, const double *qd)
{
    const kempe_model *model = system->model;
    const double *value = qd + kmp_model_coordinates(model);
    const kmp_state *state;
    const char *unit = kmp_print_unknown(system->context, "");
    int count = 0;
    for (int k = 0; (state = next_held(model, &k)); k++)
        kmp_text_printf(text, "%s%s = %.6g%s%s", count++ ? ", " : label, state->name, value[k], *unit ? " " : "", unit);
    if (count > 0)
        kmp_text_put(text, count == 1 ? ": this state changes at events, and is constant in small motions\n"
                                      : ": these states change at events, and are constant in small motions\n");
}

void kmp_print_held_json(kmp_json *json, const kempe_system *system, const double *qd)
{
    const kempe_model *model = system->model;
    const double *value = qd + kmp_model_coordinates(model);
    const kmp_state *state;
    int count = 0;
    for (int k = 0; (state = next_held(model, &k)); k++) {
        if (count++ == 0)
            kmp_json_object(json, "held");
        kmp_json_number(json, state->name, value[k]);
    }
    if (count > 0)
        kmp_json_end(json);
}

static bool closure_has_time(const kmp_closure *closure)
{
    bool found = kmp_expr_has_time(closure->function);
    for (int k = 0; k < closure->curve_count && k < 2; k++)
        found = found || kmp_expr_has_time(closure->curve[k]);
    return found;
}

static bool force_has_time(const kmp_force *force)
{
    bool found = kmp_expr_has_time(force->effort) || kmp_expr_has_time(force->holding_effort) ||
                 kmp_expr_has_time(force->sliding) || kmp_expr_has_time(force->touch.gap);
    for (int k = 0; k < 3; k++)
        found = found || kmp_expr_has_time(force->vector[k]);
    return found;
}

bool kmp_model_has_time(const kempe_model *model)
{
    bool found = false;
    for (int k = 0; k < model->force_count; k++)
        found = found || force_has_time(&model->forces[k]);
    for (int k = 0; k < model->closure_count; k++)
        found = found || closure_has_time(&model->closures[k]);
    return found;
}
