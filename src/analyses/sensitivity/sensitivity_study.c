/* SPDX-License-Identifier: BSD-3-Clause */
/* Derivatives by parameters: options, the equations with variable parameters, the table. */
#include "analyses/sensitivity/sensitivity_study.h"
#include "base/clock.h"
#include "base/memory.h"
#include "constraints/inexact/nearest_exact.h"
#include "dynamics/load_dependent.h"
#include "model/data/model.h"
#include "model/read/loads.h"
#include "model/read/read_outputs.h"
#include "output/print.h"
#include <kempe/sensitivity.h>
#include <math.h>
#include <string.h>

static const kmp_sensitivity_kind *const kinds[] = {
#define KMP_SENSITIVITY(name) &kmp_sensitivity_##name,
#include "analyses/sensitivity/sensitivities.def"
#undef KMP_SENSITIVITY
};

enum { KINDS = sizeof kinds / sizeof *kinds };

/* -- options ----------------------------------------------------------------------------------------- */

static kempe_status find_kind(kempe_sensitivity *s)
{
    const char *word = s->options->of ? s->options->of : kinds[0]->name;
    kmp_text sentence = {0};
    for (int k = 0; k < KINDS; k++)
        if (strcmp(kinds[k]->name, word) == 0) {
            s->kind = kinds[k];
            return KEMPE_OK;
        }
    kmp_text_printf(&sentence, "sensitivities of '%s' are unknown; available: ", word);
    for (int k = 0; k < KINDS; k++)
        kmp_text_printf(&sentence, "%s%s", k ? ", " : "", kinds[k]->name);
    return kmp_fail_text(s->context, KEMPE_E_ARGUMENT, &sentence);
}

static kempe_status check_method(const kempe_sensitivity *s)
{
    const char *method = s->options->method;
    if (method && strcmp(method, "forward") != 0 && strcmp(method, "adjoint") != 0)
        return kmp_fail(s->context, KEMPE_E_ARGUMENT, "unknown method '%s'; available: forward, adjoint", method);
    if ((method || s->options->integral) && !s->kind->integrals)
        return kmp_fail(s->context, KEMPE_E_ARGUMENT, "sensitivities of '%s' have no integral and only one method",
                        s->kind->name);
    bool start = s->options->at && strcmp(s->options->at, "start") == 0;
    if (!s->differences)
        KMP_TRY(kmp_refuse_friction(s->model, "sensitivities"));
    if (!s->kind->rests || start) /* at an equilibrium contacts that press stay closed */
        KMP_TRY(kmp_refuse_contacts(s->model, "sensitivities"));
    if (s->run->checkpoint || s->run->resume)
        return kmp_fail(
            s->context, KEMPE_E_ARGUMENT,
            "sensitivities have no checkpoints: the rows of a checkpoint have no derivatives to continue from");
    if (s->options->at && s->kind->integrals && strcmp(s->options->at, "start") != 0)
        return kmp_fail(s->context, KEMPE_E_ARGUMENT,
                        "a trajectory begins at the start, not at '%s': use --of reactions, modes or equilibrium there",
                        s->options->at);
    return KEMPE_OK;
}

static void add_name(kempe_sensitivity *s, const char *name, size_t length)
{
    s->name[s->count++] = kmp_arena_printf(&s->arena, "%.*s", (int)length, name);
}

/* The listed parameters; without a list all plain numbers among those of the given model that may vary. */
static void name_parameters(kempe_sensitivity *s, const char *list)
{
    const kempe_model *model = s->given ? s->given->model : s->model;
    int most = 1 + model->parameter_count;
    for (const char *c = list; c && *c; c++)
        most += *c == ',' || *c == ' ';
    s->name = KMP_ARENA_NEW(&s->arena, char *, most);
    for (int k = 0; s->name && !list && k < model->parameter_count; k++)
        if (!model->parameters[k].fixed && !model->parameters[k].number.expr)
            add_name(s, model->parameters[k].name, strlen(model->parameters[k].name));
    while (s->name && list && *list) {
        list += strspn(list, ", ");
        size_t length = strcspn(list, ", ");
        if (length > 0)
            add_name(s, list, length);
        list += length;
    }
}

static kempe_status derive(kempe_sensitivity *s)
{
    KMP_TRY(kmp_variant_new(s->model, s->count, (const char *const *)s->name, &s->variant));
    /* The requested outputs, or the usual ones of the kind. */
    kmp_text words = {0};
    if (s->options->outputs)
        kmp_text_put(&words, s->options->outputs);
    else if (s->kind->outputs)
        s->kind->outputs(s->model, &words);
    kempe_status status = words.failed ? kmp_fail_memory(s->context) : KEMPE_OK;
    if (status == KEMPE_OK && words.s)
        status = kmp_requested_outputs(kmp_variant_model(s->variant), words.s, &s->parts);
    kmp_text_free(&words);
    KMP_TRY(status);
    KMP_TRY(kmp_system_of_variant(s->variant, &s->system));
    KMP_TRY(kmp_made(s->context, KMP_ARENA_EACH(&s->arena, double, s->count, &s->parameter, &s->size)));
    for (int k = 0; k < s->count; k++) {
        const kempe_model *copy = kmp_variant_model(s->variant);
        int of = kmp_parameter_find(copy, s->name[k]);
        s->parameter[k] = of < 0 ? 0 : copy->parameters[of].number.value;
        s->size[k] = s->parameter[k] != 0 ? fabs(s->parameter[k]) : 1;
    }
    return KEMPE_OK;
}

/* At an equilibrium each sampled state is its `next`, and each delayed signal is the signal, as in the averaged
 * system. A state of events is constant. */
static kempe_status take_samples(kempe_sensitivity *s)
{
    bool start = s->options->at && strcmp(s->options->at, "start") == 0, rests = s->kind->rests && !start;
    if (!rests && !s->kind->integrals)
        KMP_TRY(kmp_refuse_delays(s->model, "sensitivities", KMP_INSTEAD_OF_DELAY));
    if (!kmp_model_has_samples(s->model) && s->model->delay_count == 0)
        return KEMPE_OK;
    if (s->kind->integrals) /* a run takes the samples */
        return KEMPE_OK;
    if (!rests)
        KMP_TRY(kmp_refuse_samples(s->model, "sensitivities", s->kind->holds && !start));
    KMP_TRY(kmp_system_new(s->model, NULL, &s->given));
    KMP_TRY(kmp_averaged_new(s->given, &s->averaged));
    s->model = kmp_averaged_system(s->averaged, s->given)->model;
    return KEMPE_OK;
}

/* -- the object -------------------------------------------------------------------------------------- */

static kempe_status begin(const kempe_model *model, const kempe_sensitivity_options *options,
                          const kempe_run_options *run, bool differences, kempe_sensitivity **sensitivity)
{
    KMP_MAKE(model->context, kempe_sensitivity, s);
    *s = (kempe_sensitivity){.kind = kinds[0],
                             .model = model,
                             .context = model->context,
                             .options = options,
                             .integral = options->integral,
                             .run = run,
                             .differences = differences && kmp_model_sticks(model),
                             .method = "",
                             .integrator = ""};
    *sensitivity = s;
    KMP_TRY(find_kind(s));
    KMP_TRY(take_samples(s));
    KMP_TRY(check_method(s));
    name_parameters(s, s->options->parameters);
    KMP_TRY(kmp_made(s->context, !s->arena.failed));
    if (s->count == 0)
        return kmp_fail(s->context, KEMPE_E_ARGUMENT,
                        "there is no parameter to differentiate with respect to: define some in the model "
                        "(parameters:), or name start values as q.NAME and qd.NAME");
    return derive(s);
}

kempe_status kmp_sensitivity_begin(const kempe_model *model, const kempe_sensitivity_options *options,
                                   const kempe_run_options *run, bool differences, kempe_sensitivity **sensitivity)
{
    kempe_sensitivity *s = NULL;
    kempe_status status = begin(model, options, run, differences, &s);
    return KMP_GIVE_OR_FREE(status, sensitivity, s, kempe_sensitivity_free);
}

kempe_status kempe_sensitivity_new(const kempe_model *model, const kempe_sensitivity_options *options,
                                   kempe_sensitivity **sensitivity)
{
    KMP_WANTED_BOTH(model, sensitivity);
    KMP_OPTIONS(model->context, kempe_sensitivity_options, options);
    const kempe_run_options *run = options->run;
    KMP_OPTIONS(model->context, kempe_run_options, run);
    double started = kmp_cpu_now();
    kmp_model_begin_forces(model);
    KMP_TRY(kmp_model_check_finished(model));
    kempe_sensitivity *s = NULL;
    kempe_status status = begin(model, options, run, false, &s);
    if (!s)
        return status;
    double derived = s->build_s = kmp_cpu_now() - started;
    started = kmp_cpu_now();
    s->status = kmp_context_verdict(s->context, status == KEMPE_OK ? s->kind->find(s) : status);
    s->cpu_s = kmp_cpu_now() - started - (s->build_s - derived) - s->again_s;
    s->unchecked = run->no_convergence_check;
    s->options = NULL;
    s->run = NULL;
    s->warnings = kmp_context_warnings(s->context);
    bool partly = status == KEMPE_OK && s->rows > 0 && (s->status == KEMPE_E_FAILED || s->status == KEMPE_STOPPED);
    if (!kmp_is_complete(s->status) && !partly) {
        status = s->status;
        kempe_sensitivity_free(s);
        return status;
    }
    if (!s->reason)
        s->reason = kmp_strdup("");
    *sensitivity = s;
    return s->status;
}

KMP_FREES(kempe_sensitivity, s, kempe_system_free(s->system), kmp_variant_free(s->variant),
          kmp_averaged_free(s->averaged), kempe_system_free(s->given), kmp_columns_free(&s->outputs), kmp_free(s->at),
          kmp_free(s->cell), kmp_free(s->warnings), kmp_free(s->reason), kmp_arena_free(&s->arena))

/* -- columns and rows -------------------------------------------------------------------------------- */

bool kmp_sensitivity_add_column(kempe_sensitivity *s, const char *name, const char *unit)
{
    char **columns = kmp_arena_room(&s->arena, s->column, s->columns, sizeof *columns);
    char **units = kmp_arena_room(&s->arena, s->unit, s->columns, sizeof *units);
    if (!columns || !units)
        return false;
    s->column = columns;
    s->unit = units;
    s->column[s->columns] = kmp_arena_strdup(&s->arena, name);
    s->unit[s->columns++] = kmp_arena_strdup(&s->arena, unit);
    return !s->arena.failed;
}

bool kmp_sensitivity_choose(kempe_sensitivity *s)
{
    bool ok = kmp_columns_init(&s->outputs, s->system, s->system->model, s->parts);
    s->chosen = ok ? KMP_ARENA_NEW(&s->arena, int, s->outputs.count) : NULL;
    for (int k = 0; s->chosen && ok && k < s->outputs.count; k++) {
        if (s->outputs.of[k].output < 0)
            continue;
        s->chosen[s->columns] = k;
        ok = kmp_sensitivity_add_column(s, s->outputs.name[k], s->outputs.unit[k]);
    }
    return s->chosen && ok;
}

void kmp_sensitivity_fill(const kempe_sensitivity *s, const kmp_sensitivity_source *source, double *row)
{
    const int n = s->system->n, size[] = {n, n, n, s->system->m, source->shown};
    for (int c = 0; c < s->columns; c++) {
        const kmp_column *of = &s->outputs.of[s->chosen[c]];
        row[c] = source->value[of->quantity][of->index];
        for (int k = 0; k < s->count; k++)
            row[s->columns + c * s->count + k] = source->slope[of->quantity][k * size[of->quantity] + of->index];
    }
}

double *kmp_sensitivity_add_row(kempe_sensitivity *s, double at)
{
    double *times = kmp_list_room(s->at, (size_t)s->rows, sizeof *times);
    s->at = times ? times : s->at;
    double *cell = kmp_list_room(s->cell, (size_t)s->rows, kmp_sensitivity_width(s) * sizeof *cell);
    s->cell = cell ? cell : s->cell;
    if (!times || !cell)
        return NULL;
    s->at[s->rows] = at;
    return s->cell + (size_t)s->rows++ * kmp_sensitivity_width(s);
}

/* -- queries ----------------------------------------------------------------------------------------- */

KMP_GETTER(const char *kempe_sensitivity_method(const kempe_sensitivity *s), s, s->method, "")
KMP_GETTER(kempe_slope_work kempe_sensitivity_work(const kempe_sensitivity *s), s, s->work, (kempe_slope_work){0})
