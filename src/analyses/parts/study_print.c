/* SPDX-License-Identifier: BSD-3-Clause */
#include "analyses/parts/study_print.h"
#include "model/data/model.h"
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
    return "";
}

/* A unit with blanks between its parts, as in all texts. */
static void put_dimension(kmp_text *text, kmp_dimension dimension)
{
    kmp_text unit = {0};
    kmp_dimension_print(&unit, dimension);
    for (size_t k = 0; k < unit.length; k++)
        if (unit.s[k] == '*')
            unit.s[k] = ' ';
    kmp_text_put(text, unit.s ? unit.s : "");
    kmp_text_free_part(text, &unit);
}

/* The unit `known` of a start value, or the unit of a parameter's dimension. */
static void put_unit(kmp_text *text, const char *before, const kempe_system *system, const char *name,
                     const char *known)
{
    const int at = kmp_parameter_find(system->model, name);
    const bool physical = at >= 0 && kmp_dimension_is_physical(system->model->parameters[at].dimension);
    if (!*known && !physical)
        return;
    kmp_text_printf(text, "%s%s", before, known);
    if (physical)
        put_dimension(text, system->model->parameters[at].dimension);
}

void kmp_print_parameter_unit(kmp_text *text, const char *before, const kempe_system *system, const char *name)
{
    put_unit(text, before, system, name, kmp_quantity_unit_of(system, name));
}

void kmp_print_unit_of(kmp_text *text, const kempe_system *system, const char *name)
{
    put_unit(text, " ", system, name, kmp_shown_as(system->context, kmp_quantity_unit_of(system, name)).unit);
}

void kmp_print_value_of(kmp_text *text, const kempe_system *system, const char *name, double value)
{
    kmp_shown as = kmp_shown_as(system->context, kmp_quantity_unit_of(system, name));
    kmp_text_printf(text, "%.6g", as.factor * value + 0.0);
    kmp_print_unit_of(text, system, name);
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
    int count = 0;
    for (int k = 0; (state = next_held(model, &k)); k++)
        kmp_text_printf(text, "%s%s = %.6g", count++ ? ", " : label, state->name, value[k]);
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
