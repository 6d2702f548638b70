/* SPDX-License-Identifier: BSD-3-Clause */
/* Derivatives by parameters: options, the equations with variable parameters, the table. */
#include "studies/sensitivity/sensitivity.h"
#include "base/clock.h"
#include "base/memory.h"
#include "constraints/rounding/mend.h"
#include "model/tables/asked.h"
#include "model/tables/nearest.h"
#include <kempe/sensitivity.h>
#include <math.h>
#include <string.h>

static const kmp_sensitivity_kind *const kinds[] = {
#define KMP_SENSITIVITY(name) &kmp_sensitivity_##name,
#include "studies/sensitivity/sensitivities.def"
#undef KMP_SENSITIVITY
};

enum { KINDS = sizeof kinds / sizeof *kinds };

/* -- options ----------------------------------------------------------------------------------------- */

static kempe_status find_kind(kempe_sensitivity *s)
{
    const char *word = s->ask->of ? s->ask->of : kinds[0]->name;
    kmp_text names = {0};
    for (int k = 0; k < KINDS; k++) {
        if (strcmp(kinds[k]->name, word) == 0) {
            s->kind = kinds[k];
            kmp_text_free(&names);
            return KEMPE_OK;
        }
        kmp_text_printf(&names, "%s%s", k ? ", " : "", kinds[k]->name);
    }
    kempe_status status = kmp_fail(s->context, KEMPE_E_ARGUMENT, "sensitivities of '%s' are unknown; available: %s",
                                   word, names.s ? names.s : "");
    kmp_text_free(&names);
    return status;
}

static kempe_status check_method(const kempe_sensitivity *s)
{
    const char *method = s->ask->method;
    if (method && strcmp(method, "forward") != 0 && strcmp(method, "adjoint") != 0)
        return kmp_fail(s->context, KEMPE_E_ARGUMENT, "unknown method '%s'; available: forward, adjoint", method);
    if ((method || s->ask->integral) && !s->kind->integrals)
        return kmp_fail(s->context, KEMPE_E_ARGUMENT, "sensitivities of '%s' have no integral and only one method",
                        s->kind->name);
    if (s->ask->run.checkpoint || s->ask->run.resume)
        return kmp_fail(
            s->context, KEMPE_E_ARGUMENT,
            "sensitivities have no checkpoints: the rows of a checkpoint have no derivatives to continue from");
    if (s->ask->at && s->kind->integrals && strcmp(s->ask->at, "start") != 0)
        return kmp_fail(s->context, KEMPE_E_ARGUMENT,
                        "a trajectory begins at the start, not at '%s': use --of reactions, modes or equilibrium there",
                        s->ask->at);
    return KEMPE_OK;
}

static bool add_name(kempe_sensitivity *s, const char *name, size_t length)
{
    kmp_text text = {0};
    kmp_text_printf(&text, "%.*s", (int)length, name);
    s->name[s->count] = kmp_text_take(&text);
    return s->name[s->count++];
}

/* All plain numbers among the parameters that may vary. */
static bool take_all(kempe_sensitivity *s)
{
    bool ok = (s->name = KMP_NEW(char *, s->model->parameter_count));
    for (int k = 0; ok && k < s->model->parameter_count; k++) {
        const kmp_parameter *p = &s->model->parameters[k];
        if (!p->fixed && !p->number.expr)
            ok = add_name(s, p->name, strlen(p->name));
    }
    return ok;
}

static bool take_listed(kempe_sensitivity *s, const char *list)
{
    int most = 1;
    for (const char *c = list; *c; c++)
        most += *c == ',';
    bool ok = (s->name = KMP_NEW(char *, most));
    while (ok && *list) {
        list += strspn(list, ", ");
        size_t length = strcspn(list, ", ");
        ok = length == 0 || add_name(s, list, length);
        list += length;
    }
    return ok;
}

static kempe_status take_names(kempe_sensitivity *s)
{
    bool ok = s->ask->parameters ? take_listed(s, s->ask->parameters) : take_all(s);
    if (!ok)
        return kmp_fail_memory(s->context);
    if (s->count == 0)
        return kmp_fail(s->context, KEMPE_E_ARGUMENT,
                        "there is no parameter to differentiate with respect to: define some in the model "
                        "(parameters:), or name start values as q.NAME and qd.NAME");
    return KEMPE_OK;
}

static double value_of(const kempe_model *m, const char *name)
{
    int k = kmp_parameter_find(m, name);
    return k < 0 ? 0 : m->parameters[k].number.value;
}

/* The requested outputs, or the usual ones of the kind. */
static kempe_status take_outputs(kempe_sensitivity *s)
{
    kmp_text words = {0};
    if (s->ask->outputs)
        kmp_text_put(&words, s->ask->outputs);
    else if (s->kind->outputs)
        s->kind->outputs(s->model, &words);
    kempe_status status = words.failed ? kmp_fail_memory(s->context) : KEMPE_OK;
    if (status == KEMPE_OK && words.s)
        status = kmp_asked_outputs(kmp_variant_model(s->variant), words.s, &s->parts);
    kmp_text_free(&words);
    return status;
}

static kempe_status derive(kempe_sensitivity *s)
{
    kempe_status status = kmp_variant_new(s->model, s->count, (const char *const *)s->name, &s->variant);
    if (status == KEMPE_OK)
        status = take_outputs(s);
    if (status == KEMPE_OK)
        status = kmp_system_of_variant(s->variant, &s->system);
    if (status != KEMPE_OK)
        return status;
    s->parameter = KMP_NEW(double, s->count);
    s->size = KMP_NEW(double, s->count);
    if (!s->parameter || !s->size)
        return kmp_fail_memory(s->context);
    for (int k = 0; k < s->count; k++) {
        s->parameter[k] = value_of(kmp_variant_model(s->variant), s->name[k]);
        s->size[k] = s->parameter[k] != 0 ? fabs(s->parameter[k]) : 1;
    }
    return KEMPE_OK;
}

static kempe_status prepare(kempe_sensitivity *s)
{
    kempe_status status = find_kind(s);
    if (status == KEMPE_OK)
        status = check_method(s);
    if (status == KEMPE_OK)
        status = take_names(s);
    return status == KEMPE_OK ? derive(s) : status;
}

/* -- the object -------------------------------------------------------------------------------------- */

kempe_status kempe_sensitivity_new(const kempe_model *model, const kempe_sensitivity_options *ask,
                                   kempe_sensitivity **sensitivity)
{
    KMP_WANTED(NULL, model, "model");
    ask = ask ? ask : &(const kempe_sensitivity_options){0};
    KMP_WANTED(model->context, sensitivity, "sensitivity");
    double begin = kmp_cpu_now();
    kmp_context_begin(model->context);
    KMP_TRY(kmp_model_check_finished(model));
    kempe_sensitivity *s = KMP_NEW(kempe_sensitivity, 1);
    if (!s)
        return kmp_fail_memory(model->context);
    *s = (kempe_sensitivity){
        .kind = kinds[0], .model = model, .context = model->context, .ask = ask, .method = "", .integrator = ""};
    kempe_status status = prepare(s);
    double derived = s->build_s = kmp_cpu_now() - begin;
    begin = kmp_cpu_now();
    s->status = status == KEMPE_OK ? s->kind->find(s) : status;
    s->cpu_s = kmp_cpu_now() - begin - (s->build_s - derived) - s->again_s;
    s->ask = NULL;
    s->warnings = kmp_context_warnings(s->context);
    bool partly = status == KEMPE_OK && s->rows > 0 && (s->status == KEMPE_E_FAILED || s->status == KEMPE_STOPPED);
    if (s->status != KEMPE_OK && !partly) {
        status = s->status;
        kempe_sensitivity_free(s);
        return status;
    }
    if (!s->reason)
        s->reason = kmp_strdup("");
    *sensitivity = s;
    return s->status;
}

static void free_list(int count, char **list)
{
    for (int k = 0; list && k < count; k++)
        kmp_free(list[k]);
    kmp_free(list);
}

void kempe_sensitivity_free(kempe_sensitivity *s)
{
    if (!s)
        return;
    kempe_system_free(s->system);
    kmp_variant_free(s->variant);
    free_list(s->count, s->name);
    free_list(s->columns, s->column);
    free_list(s->columns, s->unit);
    kmp_free(s->parameter);
    kmp_free(s->size);
    kmp_free(s->at);
    kmp_free(s->value);
    kmp_free(s->slope);
    kmp_free(s->warnings);
    kmp_free(s->reason);
    kmp_free(s->note);
    kmp_free(s->again_name);
    kmp_free(s);
}

bool kmp_sensitivity_add_column(kempe_sensitivity *s, const char *name, const char *unit)
{
    char **column = kmp_realloc(s->column, (size_t)s->columns + 1, sizeof *column);
    s->column = column ? column : s->column;
    char **units = kmp_realloc(s->unit, (size_t)s->columns + 1, sizeof *units);
    s->unit = units ? units : s->unit;
    if (!column || !units)
        return false;
    column[s->columns] = kmp_strdup(name);
    units[s->columns] = kmp_strdup(unit);
    s->columns++;
    return column[s->columns - 1] && units[s->columns - 1];
}

static bool grow(double **list, int room, size_t a_row)
{
    double *grown = kmp_realloc(*list, (size_t)room * a_row, sizeof *grown);
    *list = grown ? grown : *list;
    return grown;
}

bool kmp_sensitivity_add_row(kempe_sensitivity *s, double at, double **value, double **slope)
{
    size_t columns = (size_t)s->columns, slopes = columns * (size_t)s->count;
    if (s->rows == s->room) {
        int room = 2 * s->room + 16;
        if (!grow(&s->at, room, 1) || !grow(&s->value, room, columns) || !grow(&s->slope, room, slopes))
            return false;
        s->room = room;
    }
    s->at[s->rows] = at;
    *value = s->value + (size_t)s->rows * columns;
    *slope = s->slope + (size_t)s->rows * slopes;
    s->rows++;
    return true;
}

/* -- queries ----------------------------------------------------------------------------------------- */

int kempe_sensitivity_parameter_count(const kempe_sensitivity *s)
{
    KMP_GIVEN(s, 0);
    return s->count;
}

const char *kempe_sensitivity_parameter(const kempe_sensitivity *s, int k)
{
    KMP_GIVEN(s, "");
    return k >= 0 && k < s->count ? s->name[k] : "";
}

double kempe_sensitivity_parameter_value(const kempe_sensitivity *s, int k)
{
    KMP_GIVEN(s, NAN);
    return k >= 0 && k < s->count ? s->parameter[k] : NAN;
}

int kempe_sensitivity_column_count(const kempe_sensitivity *s)
{
    KMP_GIVEN(s, 0);
    return s->columns;
}

const char *kempe_sensitivity_column(const kempe_sensitivity *s, int column)
{
    KMP_GIVEN(s, "");
    return column >= 0 && column < s->columns ? s->column[column] : "";
}

int kempe_sensitivity_row_count(const kempe_sensitivity *s)
{
    KMP_GIVEN(s, 0);
    return s->rows;
}

static bool is_there(const kempe_sensitivity *s, int row, int column)
{
    return row >= 0 && row < s->rows && column >= 0 && column < s->columns;
}

double kempe_sensitivity_at(const kempe_sensitivity *s, int row)
{
    KMP_GIVEN(s, NAN);
    return row >= 0 && row < s->rows ? s->at[row] : NAN;
}

double kempe_sensitivity_value(const kempe_sensitivity *s, int row, int column)
{
    KMP_GIVEN(s, NAN);
    return is_there(s, row, column) ? s->value[(size_t)row * (size_t)s->columns + (size_t)column] : NAN;
}

double kempe_sensitivity_slope(const kempe_sensitivity *s, int row, int column, int k)
{
    KMP_GIVEN(s, NAN);
    if (!is_there(s, row, column) || k < 0 || k >= s->count)
        return NAN;
    return s->slope[((size_t)row * (size_t)s->columns + (size_t)column) * (size_t)s->count + (size_t)k];
}

const char *kempe_sensitivity_method(const kempe_sensitivity *s)
{
    KMP_GIVEN(s, "");
    return s->method;
}

kempe_slope_work kempe_sensitivity_work(const kempe_sensitivity *s)
{
    KMP_GIVEN(s, (kempe_slope_work){0});
    return s->work;
}
