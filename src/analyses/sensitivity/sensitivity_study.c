/* SPDX-License-Identifier: BSD-3-Clause */
/* Derivatives by parameters: options, the equations with variable parameters, the table. */
#include "analyses/sensitivity/sensitivity_study.h"
#include "analyses/parts/study_print.h"
#include "analyses/parts/unsupported.h"
#include "base/memory.h"
#include "constraints/inexact/nearest_exact.h"
#include "dynamics/load_dependent.h"
#include "integrators/formulations/formulation.h"
#include "model/data/model.h"
#include "model/read/loads.h"
#include "model/read/requests.h"
#include "output/print.h"
#include "output/result_table.h"
#include "output/start_balance.h"
#include "platform/platform.h"
#include <kempe/sensitivity.h>
#include <math.h>
#include <string.h>

static const kmp_sensitivity_kind *const subjects[] = {
#define KMP_SENSITIVITY(name) &kmp_sensitivity_##name,
#include "analyses/sensitivity/sensitivities.def"
#include "studies/simulate/trajectory.h"
#undef KMP_SENSITIVITY
};

enum { KINDS = sizeof subjects / sizeof *subjects };

/* -- options ----------------------------------------------------------------------------------------- */

static kempe_status find_kind(kempe_sensitivity *s)
{
    const char *word = s->options->of ? s->options->of : subjects[0]->name;
    kmp_text sentence = {0};
    for (int k = 0; k < KINDS; k++)
        if (strcmp(subjects[k]->name, word) == 0) {
            s->kind = subjects[k];
            return KEMPE_OK;
        }
    kmp_text_printf(&sentence, "sensitivities of '%s' are unknown; available: ", word);
    for (int k = 0; k < KINDS; k++)
        kmp_text_printf(&sentence, "%s%s", k ? ", " : "", subjects[k]->name);
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
    if (!s->kind->integrals)
        KMP_TRY(kmp_refuse_friction(s->model, "sensitivities"));
    if (!s->kind->integrals && (!s->kind->rests || start)) /* at an equilibrium contacts that press stay closed */
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

/* The listed parameters; without a list all plain numbers among the parameters of the given model that may vary. */
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

/* A row between rates leaves the change of the position to the whole motion before. */
static kempe_status check_rolling(kempe_sensitivity *s)
{
    const char *row = s->kind->integrals ? kmp_formulation_row_of_rates(s->system) : NULL;
    if (!row || s->differences)
        return KEMPE_OK;
    return kmp_fail(
        s->context, KEMPE_E_ARGUMENT,
        "sensitivities: '%s' holds rates: no function of the coordinates is the way of its surfaces, and positions "
        "depend on the whole motion before, which is not supported there",
        row);
}

static kempe_status derive(kempe_sensitivity *s)
{
    KMP_TRY(kmp_variant_new_with_inputs(s->model, s->count, (const char *const *)s->name, &s->variant));
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
    s->differences = s->differences && kmp_formulation_row_of_rates(s->system);
    KMP_TRY(check_rolling(s));
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
    if (!kmp_model_has_samples(s->model) && s->model->delay_count == 0 &&
        !(rests && kmp_tracks_are_irregular(s->model->track_count, s->model->tracks)))
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

/* `asked`: the run has only options of a caller. */
static kempe_status begin(const kempe_model *model, const kempe_sensitivity_options *options,
                          const kempe_run_options *run, bool asked, bool differences, kempe_sensitivity **sensitivity)
{
    KMP_MAKE(model->context, kempe_sensitivity, s);
    *s = (kempe_sensitivity){.kind = subjects[0],
                             .model = model,
                             .context = model->context,
                             .options = options,
                             .integral = options->integral,
                             .run = run,
                             .differences = differences,
                             .method = "",
                             .integrator = ""};
    *sensitivity = s;
    KMP_TRY(find_kind(s));
    KMP_TRY(take_samples(s));
    KMP_TRY(check_method(s));
    if (asked)
        KMP_TRY(kmp_run_options_check(s->context, run, s->kind->integrals ? KMP_STUDY_SENSITIVITY : KMP_STUDY_STATE));
    name_parameters(s, s->options->parameters);
    KMP_TRY(kmp_made(s->context, !s->arena.failed));
    if (s->count == 0)
        return kmp_fail(s->context, KEMPE_E_ARGUMENT,
                        "no parameter is given for the derivatives: define some in the model (parameters:), or name "
                        "start values as q.NAME and qd.NAME");
    return derive(s);
}

kempe_status kmp_sensitivity_begin(const kempe_model *model, const kempe_sensitivity_options *options,
                                   const kempe_run_options *run, bool differences, kempe_sensitivity **sensitivity)
{
    kempe_sensitivity *s = NULL;
    kempe_status status = begin(model, options, run, false, differences, &s);
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
    kempe_status status = begin(model, options, run, true, false, &s);
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
        if (status == KEMPE_STOPPED && s->reason && *s->reason && !kmp_interrupted(s->context))
            status = kmp_fail(s->context, KEMPE_E_FAILED,
                              "%s, before the time that these derivatives are of: choose an earlier t_end, or the "
                              "forward method without an integral",
                              s->reason);
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

/* -- text -------------------------------------------------------------------------------------------- */

/* The unit of a column as results show it, but for the time of its integral. */
static kmp_shown column_shown(const kempe_sensitivity *s, int column)
{
    const char *unit = s->unit[column];
    return kmp_shown_as(s->context, s->kind->plain ? unit : kmp_print_unknown(s->context, unit));
}

static double factor_of(const kempe_sensitivity *s, int column)
{
    return column_shown(s, column).factor;
}

/* The factor of a derivative by parameter k: of the quotient of both units. */
static double slope_factor(const kempe_sensitivity *s, int column, int k)
{
    return factor_of(s, column) / kmp_shown_of(s->system, s->name[k]).factor;
}

static void put_unit(kmp_text *text, const kempe_sensitivity *s, int column)
{
    const char *unit = column_shown(s, column).unit;
    kmp_text_printf(text, "%s%s", unit, s->integral && *unit ? " s" : "");
}

/* The words above the derivatives by a parameter, with its unit where that is known: "per m of crank". */
static char *per_parameter(const kempe_sensitivity *s, int k)
{
    kmp_text text = {0};
    kmp_text_put(&text, "per");
    const char *unit = kmp_shown_of(s->system, s->name[k]).unit;
    const bool known = *kmp_quantity_unit_of(s->system, s->name[k]);
    kmp_text_printf(&text, "%s%s%s %s", *unit ? " " : "", unit, known ? " of" : *unit ? " unit of" : "", s->name[k]);
    return kmp_text_take(&text);
}

/* The size of a column in its row, for rounding: of its value, and of its changes by parameters of their sizes. */
static double size_of(const kempe_sensitivity *s, int row, int column)
{
    double size = fabs(kmp_sensitivity_value(s, row, column));
    for (int k = 0; k < s->count; k++)
        size = fmax(size, fabs(kmp_sensitivity_slope(s, row, column, k) * s->size[k]));
    return isfinite(size) ? size : 0;
}

enum { NUMBER = 12 }; /* the width of a number */

/* The last row by parameters first .. end - 1. */
static void put_block(const kempe_sensitivity *s, kmp_text *text, int first, int end, char *const *heads, int name,
                      int unit)
{
    const int row = s->rows - 1;
    kmp_text at = {0};
    if (s->kind->row)
        kmp_text_printf(&at, "at %s = %.6g%s", s->kind->row, s->at[row], strcmp(s->kind->row, "t") == 0 ? " s" : "");
    kmp_text_printf(text, "\n%-*s %*s", name + unit + 3, at.s ? at.s : "", NUMBER, "value");
    kmp_text_free_part(text, &at);
    for (int k = first; k < end; k++)
        kmp_text_printf(text, "  %*s", NUMBER, heads[k]);
    kmp_text_put(text, "\n");
    for (int c = 0; c < s->columns; c++) {
        const double factor = factor_of(s, c), noise = KMP_PRINT_NOISE * size_of(s, row, c);
        const size_t length = text->length;
        kmp_text_printf(text, "  %-*s ", name, s->column[c]);
        put_unit(text, s, c);
        kmp_text_printf(text, "%*s", (int)(length + (size_t)(name + unit + 4)) - (int)text->length, "");
        kmp_print_cells(text, "%*.6g", NUMBER, factor * kmp_print_clean(kmp_sensitivity_value(s, row, c), noise));
        for (int k = first; k < end; k++)
            kmp_print_cells(text, "  %*.6g", (int)fmax(NUMBER, (double)strlen(heads[k])),
                            slope_factor(s, c, k) *
                                kmp_print_clean(kmp_sensitivity_slope(s, row, c, k), noise / s->size[k]));
        kmp_text_put(text, "\n");
    }
}

/* The last row, with as many parameters at a time as a line has room for. */
static void put_blocks(const kempe_sensitivity *s, kmp_text *text)
{
    kmp_arena arena = {0};
    char **heads = KMP_ARENA_NEW(&arena, char *, s->count);
    const int name = kmp_print_widest(s->columns, s->column, 8);
    int unit = 1;
    for (int c = 0; c < s->columns; c++)
        unit = (int)fmax(unit, (double)strlen(column_shown(s, c).unit) + (s->integral ? 2 : 0));
    bool whole = heads;
    for (int k = 0; whole && k < s->count; k++)
        whole = (heads[k] = per_parameter(s, k)) != NULL;
    for (int first = 0, end; whole && first < s->count; first = end) {
        int width = name + unit + 4 + NUMBER;
        for (end = first; end < s->count; end++) {
            width += 2 + (int)fmax(NUMBER, (double)strlen(heads[end]));
            if (end > first && width > KMP_PRINT_LINE)
                break;
        }
        put_block(s, text, first, end, heads, name, unit);
    }
    for (int k = 0; heads && k < s->count; k++)
        kmp_free(heads[k]);
    kmp_arena_free(&arena);
    text->failed = text->failed || !whole;
}

/* Their names, or the number of many. */
static void put_parameters(const kempe_sensitivity *s, kmp_text *text)
{
    enum { NAMED = 3 };
    if (s->count > NAMED)
        kmp_text_printf(text, "%d parameters", s->count);
    for (int k = 0; s->count <= NAMED && k < s->count; k++)
        kmp_text_printf(text, "%s%s", k == 0 ? "" : k + 1 < s->count ? ", " : " and ", s->name[k]);
}

static void put_text(kmp_text *text, const void *result)
{
    const kempe_sensitivity *s = result;
    const kempe_outcome outcome = kmp_outcome_checked(s->status, !s->unchecked);
    kmp_print_title(text, s->model, outcome);
    kmp_text_printf(text, "derivatives of %sthe %s with respect to ", s->integral ? "time integrals over " : "",
                    s->kind->integrals ? "motion" : s->kind->name);
    put_parameters(s, text);
    kmp_text_printf(text, s->t_end > 0 ? ", 0 to %.6g s\n" : "\n", s->t_end);
    if (s->kind->integrals)
        kmp_starts_show(text, "run", kmp_model_start(s->model)->at);
    if (s->reason[0])
        kmp_print_wrapped(text, "  ", 4, s->reason);
    kmp_print_doubts(text, outcome, s->warnings);
    if (s->rows > 0)
        put_blocks(s, text);
    kmp_text_put(text, s->t_end > 0 || s->note ? "\n" : "");
    if (s->t_end > 0) {
        kmp_text words = {0};
        kmp_convergence_put(&words, s->context, &s->again, s->again_name, NULL);
        if (words.s)
            kmp_print_wrapped(text, "accuracy  ", 10, words.s);
        kmp_text_free_part(text, &words);
        kmp_text_printf(text, "method    %s, integrator %s, rtol %g, atol %g", s->method, s->integrator, s->rtol,
                        s->atol);
        kmp_backend_print(text, s->backend);
        kmp_text_printf(text, ", %ld steps\n", s->work.steps);
    }
    if (s->rows > 1)
        kmp_text_printf(text, "rows      %d, the last one is shown; -o FILE.csv writes all\n", s->rows);
    if (s->note)
        kmp_print_wrapped(text, "note      ", 10, s->note);
}

/* -- JSON -------------------------------------------------------------------------------------------- */

static void put_json(kmp_text *text, const void *result)
{
    const kempe_sensitivity *s = result;
    kmp_json json = kmp_print_head(text, s->system, kmp_outcome_checked(s->status, !s->unchecked), s->reason,
                                   s->build_s, s->warnings);
    kmp_json_string(&json, "of", s->kind->name);
    if (s->t_end > 0) {
        kmp_json_put(&json, "method %s integrator %s t_end %g rtol %g atol %g", s->method, s->integrator, s->t_end,
                     s->rtol, s->atol);
        kmp_convergence_json(&json, &s->again, s->again_name);
        kmp_json_put(&json,
                     "work { steps %ld rejected %ld refused %ld rhs %ld exchanges %ld backwards %g backwards_s %g "
                     "kept_bytes %g }",
                     s->work.steps, s->work.rejected, s->work.refused, s->work.rhs, s->work.exchanges, s->backwards,
                     s->backwards_s, s->kept);
    }
    kmp_json_put(&json, "backend %s cpu_s %g parameters {", s->backend, s->cpu_s);
    for (int k = 0; k < s->count; k++)
        kmp_json_number(&json, s->name[k], s->parameter[k]);
    kmp_json_end(&json);
    if (s->note)
        kmp_json_string(&json, "note", s->note);
    kmp_json_whole(&json, "rows", s->rows);
    if (s->rows > 0) {
        int row = s->rows - 1;
        kmp_json_object(&json, "end");
        if (s->kind->row)
            kmp_json_number(&json, s->kind->row, s->at[row]);
        kmp_json_object(&json, "values");
        for (int c = 0; c < s->columns; c++)
            kmp_json_number(&json, s->column[c], kmp_sensitivity_value(s, row, c));
        kmp_json_put(&json, "} derivatives {");
        for (int c = 0; c < s->columns; c++) {
            kmp_json_object(&json, s->column[c]);
            for (int k = 0; k < s->count; k++)
                kmp_json_number(&json, s->name[k], kmp_sensitivity_slope(s, row, c, k));
            kmp_json_end(&json);
        }
        kmp_json_put(&json, "} }");
    }
    kmp_json_end(&json);
}

KMP_PRINT(kempe_sensitivity, sensitivity, sensitivity->context, put_json, put_text)

/* -- tables ------------------------------------------------------------------------------------------ */

/* The unit of a derivative: "rad/m", "m/(N s/m)"; [NAME] is the SI unit of a parameter where it is unknown. */
static void put_quotient(kmp_text *text, const kempe_sensitivity *s, int column, int k)
{
    const char *by = kmp_shown_of(s->system, s->name[k]).unit, *of = column_shown(s, column).unit;
    kmp_text_put(text, *of ? "" : "1");
    put_unit(text, s, column);
    if (!*kmp_quantity_unit_of(s->system, s->name[k]))
        kmp_text_printf(text, "/[%s]", s->name[k]);
    else
        kmp_text_printf(text, strpbrk(by, " /") ? "/(%s)" : "/%s", by);
}

static void fill_rows(kempe_table *table, const void *result)
{
    const kempe_sensitivity *s = result;
    bool times = s->kind->row && strcmp(s->kind->row, "t") == 0;
    kmp_tabulate_column(table, times ? "s" : "", "%s", s->kind->row ? s->kind->row : "row");
    for (int c = 0; c < s->columns; c++) {
        kmp_text unit = {0};
        kmp_text_put(&unit, "");
        put_unit(&unit, s, c);
        kmp_tabulate_column(table, unit.s ? unit.s : "", "%s", s->column[c]);
        kmp_text_free(&unit);
        for (int k = 0; k < s->count; k++) {
            put_quotient(&unit, s, c, k);
            kmp_tabulate_column(table, unit.s ? unit.s : "", "%s/%s", s->column[c], s->name[k]);
            kmp_text_free(&unit);
        }
    }
    for (int row = 0; row < s->rows; row++) {
        KMP_TABULATE(table, "%g", s->at[row]);
        for (int c = 0; c < s->columns; c++) {
            kmp_tabulate_number(table, factor_of(s, c) * kmp_sensitivity_value(s, row, c));
            for (int k = 0; k < s->count; k++)
                kmp_tabulate_number(table, slope_factor(s, c, k) * kmp_sensitivity_slope(s, row, c, k));
        }
    }
}

static void fill_parameters(kempe_table *table, const void *result)
{
    const kempe_sensitivity *s = result;
    kmp_tabulate_columns(table, "parameter[words] value unit[words]");
    for (int k = 0; k < s->count; k++) {
        const kmp_shown as = kmp_shown_of(s->system, s->name[k]);
        KMP_TABULATE(table, "%s %g %s", s->name[k], as.factor * s->parameter[k], as.unit);
    }
}

KMP_TABLES(kempe_sensitivity, sensitivity, sensitivity->context, {"rows", fill_rows}, {"parameters", fill_parameters})
