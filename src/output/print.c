/* SPDX-License-Identifier: BSD-3-Clause */
/* Parts that reports share: heads, names, numbers in columns, errors, units, and the end of a report in text or JSON.
 * */
#include "output/print.h"
#include "constraints/inexact/nearest_exact.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool kmp_has_result(kempe_status status)
{
    return kmp_is_complete(status) || status == KEMPE_STOPPED || status == KEMPE_E_FAILED;
}

static const char *const outcome_words[] = {
    [KEMPE_OUTCOME_NONE] = "",
    [KEMPE_OUTCOME_COMPLETE] = "complete",
    [KEMPE_OUTCOME_NOT_CHECKED] = "complete, not checked",
    [KEMPE_OUTCOME_NOT_TRUSTWORTHY] = "not trustworthy",
    [KEMPE_OUTCOME_STOPPED] = "stopped",
    [KEMPE_OUTCOME_FAILED] = "failed",
};
enum { OUTCOMES = sizeof outcome_words / sizeof *outcome_words };

const char *kempe_outcome_text(kempe_outcome outcome)
{
    return outcome_words[(unsigned)outcome < OUTCOMES ? outcome : KEMPE_OUTCOME_NONE];
}

kempe_outcome kmp_outcome_read(const char *word)
{
    int k = OUTCOMES - 1;
    while (k > 0 && strcmp(word, outcome_words[k]) != 0)
        k--;
    return (kempe_outcome)k;
}

kempe_outcome kmp_outcome_of(kempe_status status)
{
    return status == KEMPE_OK          ? KEMPE_OUTCOME_COMPLETE
           : status == KEMPE_UNTRUSTED ? KEMPE_OUTCOME_NOT_TRUSTWORTHY
           : status == KEMPE_STOPPED   ? KEMPE_OUTCOME_STOPPED
                                       : KEMPE_OUTCOME_FAILED;
}

kempe_outcome kmp_outcome_checked(kempe_status status, bool checked)
{
    return status == KEMPE_OK && !checked ? KEMPE_OUTCOME_NOT_CHECKED : kmp_outcome_of(status);
}

bool kmp_outcome_is_complete(kempe_outcome outcome)
{
    return outcome > KEMPE_OUTCOME_NONE && outcome < KEMPE_OUTCOME_STOPPED;
}

void kmp_print_title(kmp_text *text, const kempe_model *model, kempe_outcome outcome)
{
    kmp_text_printf(text, "%s: %s, ", model->name, kempe_outcome_text(outcome));
}

void kmp_print_flexible(kmp_text *text, const kempe_model *model, const char *label)
{
    for (int k = 0; k < model->flexible_count; k++) {
        const kmp_flexible *f = &model->flexibles[k];
        kmp_text_printf(text, "%s%s: stiffening %s, frame %s, %d coordinate%s\n", label, model->bodies[f->body].name,
                        kmp_stiffening_words[f->stiffening], kmp_flexible_frame_words[f->frame], f->count,
                        f->count == 1 ? "" : "s");
        if (f->doubt)
            kmp_text_printf(text, "%s%s: warning: %s\n", label, model->bodies[f->body].name, f->doubt);
    }
}

static void put_flexible(kmp_json *json, const kempe_model *model)
{
    kmp_json_object(json, "flexible");
    for (int k = 0; k < model->flexible_count; k++) {
        const kmp_flexible *f = &model->flexibles[k];
        kmp_json_put(json, "%s { stiffening %s frame %s coordinates %d", model->bodies[f->body].name,
                     kmp_stiffening_words[f->stiffening], kmp_flexible_frame_words[f->frame], f->count);
        if (f->doubt)
            kmp_json_put(json, "doubt %s", f->doubt);
        kmp_json_put(json, "}");
    }
    kmp_json_end(json);
}

void kmp_print_wrapped(kmp_text *text, const char *first, int indent, const char *words)
{
    int begin = (int)strlen(first), column = begin;
    kmp_text_put(text, first);
    for (;;) {
        const int blanks = (int)strspn(words, " \n");
        words += blanks;
        if (!*words)
            break;
        int word = (int)strcspn(words, " \n");
        if (strncmp(words + word, " %", 2) == 0) /* stays with its number */
            word += 2 + (int)strcspn(words + word + 2, " \n");
        const int gap = column > begin ? blanks : 0;
        const bool breaks = column > begin && column + gap + word > KMP_PRINT_LINE;
        kmp_text_printf(text, "%s%*s%.*s", breaks ? "\n" : "", breaks ? indent : gap, "", word, words);
        begin = breaks ? indent : begin;
        column = (breaks ? indent : column + gap) + word;
        words += word;
    }
    kmp_text_put(text, "\n");
}

void kmp_print_below(kmp_text *text, const char *lines)
{
    for (size_t length; *lines; lines += length + (lines[length] != '\0')) {
        kmp_text line = {0};
        length = strcspn(lines, "\n");
        kmp_text_printf(&line, "%.*s", (int)length, lines);
        kmp_print_wrapped(text, "  ", 4, line.s ? line.s : "");
        kmp_text_free_part(text, &line);
    }
}

void kmp_print_doubts(kmp_text *text, kempe_outcome outcome, const char *warnings)
{
    if (outcome == KEMPE_OUTCOME_NOT_TRUSTWORTHY && warnings)
        kmp_print_below(text, warnings);
}

void kmp_print_answer(kmp_text *text, kmp_text *title, kempe_outcome outcome, const char *warnings, const char *label,
                      const char *reason)
{
    kmp_print_wrapped(text, "", 4, title->s ? title->s : "");
    kmp_text_free_part(text, title);
    kmp_print_doubts(text, outcome, warnings);
    if (reason && *reason)
        kmp_print_wrapped(text, label, 4, reason);
}

void kmp_print_rounding(kmp_text *text, const kempe_system *system, const char *label)
{
    const int width = (int)strlen(label);
    kmp_text blanks = {0};
    kmp_text_printf(&blanks, "%*s", width, "");
    for (int c = 0, reported = 0; c < system->model->closure_count; c++) {
        kmp_text line = {0};
        kmp_put_misfit(&line, system, c);
        if (line.length > 0)
            kmp_print_wrapped(text, reported++ > 0 ? blanks.s : label, width, line.s);
        kmp_text_free_part(text, &line);
    }
    kmp_text_free_part(text, &blanks);
}

void kmp_print_lines(kmp_json *json, const char *key, const char *lines)
{
    kmp_text line = {0};
    kmp_json_array(json, key);
    for (; *lines; lines += strcspn(lines, "\n") + 1) {
        kmp_text_printf(&line, "%.*s", (int)strcspn(lines, "\n"), lines);
        kmp_json_text(json, NULL, &line);
    }
    kmp_json_end(json);
}

kmp_json kmp_print_head(kmp_text *text, const kempe_system *system, kempe_outcome outcome, const char *reason,
                        double build_s, const char *warnings)
{
    kmp_json json = kmp_json_begin(text);
    kmp_json_put(&json, "{ model %s status %s reason %s build_s %g", system->model->name, kempe_outcome_text(outcome),
                 reason ? reason : "", build_s);
    if (system->model->start.at)
        kmp_json_string(&json, "start_at", system->model->start.at);
    /* Closures that stay open as drawn, where there are any. */
    bool some = false;
    for (int c = 0; c < system->model->closure_count; c++)
        some = some || system->misfit[c] > 0;
    if (some) {
        kmp_json_put(&json, "rounding { misfit {");
        for (int c = 0; c < system->model->closure_count; c++)
            if (system->misfit[c] > 0)
                kmp_json_number(&json, system->model->closures[c].name, system->misfit[c] * system->length);
        kmp_json_put(&json, "} closure_tolerance %g corrected %i moved %g length %g }", system->closure_tolerance,
                     system->mended, system->mended_by * system->length, system->length);
    }
    if (system->model->flexible_count > 0)
        put_flexible(&json, system->model);
    if (warnings)
        kmp_print_lines(&json, "warnings", warnings);
    return json;
}

void kmp_print_unused(kmp_text *text, const kempe_model *model)
{
    const char *before = "";
    for (int k = 0; k < model->parameter_count; k++)
        if (model->parameters[k].unused) {
            kmp_text_printf(text, "%s%s", before, model->parameters[k].name);
            before = ", ";
        }
}

void kmp_print_unused_json(kmp_json *json, const kempe_model *model)
{
    kmp_json_array(json, "unused_parameters");
    for (int k = 0; k < model->parameter_count; k++)
        if (model->parameters[k].unused)
            kmp_json_string(json, NULL, model->parameters[k].name);
    kmp_json_end(json);
}

void kmp_print_entries(kmp_json *json, const char *key, const kempe_system *system, kmp_quantity quantity,
                       const double *values)
{
    kmp_json_object(json, key);
    for (int k = 0; k < kmp_quantity_size(system, quantity); k++)
        kmp_json_number(json, kmp_quantity_name(system, quantity, k), values ? values[k] : NAN);
    kmp_json_end(json);
    if (quantity == KMP_QUANTITY_QD && system->model->state_count > 0)
        kmp_print_entries(json, "state", system, KMP_QUANTITY_STATE,
                          values ? values + kmp_model_coordinates(system->model) : NULL);
}

const char *kmp_name_of_coordinate(const kempe_system *system, int k)
{
    return system->model->motions[k].name;
}

const char *kmp_name_of_row(const kempe_system *system, int k)
{
    return system->row_names[k];
}

const char *kmp_name_of_closure(const kempe_system *system, int k)
{
    return system->model->closures[k].name;
}

void kmp_print_names(kmp_json *json, const char *key, const kempe_system *system, kmp_name_fn *name, int count,
                     const int *which)
{
    kmp_json_array(json, key);
    for (int k = 0; k < count; k++)
        kmp_json_string(json, NULL, name(system, which[k]));
    kmp_json_end(json);
}

void kmp_list_names(kmp_text *text, const kempe_system *system, kmp_name_fn *name, int count, const int *which)
{
    for (int k = 0; k < count; k++)
        kmp_text_printf(text, "%s%s", k ? ", " : "", name(system, which[k]));
    kmp_text_put(text, count ? "" : "none");
}

void kmp_print_verdict(kmp_json *json, const kmp_verdict *verdict)
{
    kmp_json_put(json, "residual { h_max %g hdot_max %g", verdict->h_max, verdict->hdot_max);
    if (verdict->misfit_row >= 0)
        kmp_json_number(json, "misfit", verdict->misfit);
    kmp_json_put(json, "} energy { drift_rel %g }", verdict->drift_rel);
}

void kmp_print_errors(kmp_json *json, const kmp_verdict *verdict)
{
    kmp_json_put(json, "error { q %g qd %g lambda %g }", verdict->error[KMP_QUANTITY_Q],
                 verdict->error[KMP_QUANTITY_QD], verdict->error[KMP_QUANTITY_LAMBDA]);
}

/* The counts that each run has, as members. */
static void put_counts(kmp_json *json, const kmp_run_report *report)
{
    kmp_json_put(json, "steps %ld rejected %ld refused %ld rhs %ld", report->steps, report->rejected, report->refused,
                 report->rhs);
    kmp_json_put(json, "newton %ld jacobians %ld factorizations %ld exchanges %ld", report->newton, report->jacobians,
                 report->factorizations, report->exchanges);
}

void kmp_print_work(kmp_json *json, const kmp_run_report *report)
{
    kmp_json_object(json, "work");
    put_counts(json, report);
    kmp_json_put(json, "centrings %ld events %ld", report->centrings, report->events);
    if (report->impacts >= 0)
        kmp_json_put(json, "impacts %ld", report->impacts);
    if (report->changes >= 0)
        kmp_json_put(json, "mode_changes %ld", report->changes);
    kmp_json_put(json, "}");
}

/* True if a conversion prints no digit but 0. */
static bool rounds_to_zero(const char *conversion, double x)
{
    char printed[40];
    (void)snprintf(printed, sizeof printed, conversion, x);
    return !strpbrk(printed, "123456789");
}

void kmp_print_cells(kmp_text *text, const char *format, ...)
{
    va_list list;
    va_start(list, format);
    while (*format) {
        size_t plain = strcspn(format, "%");
        kmp_text_printf(text, "%.*s", (int)plain, format);
        format += plain;
        /* A conversion by itself, with numbers in place of stars. */
        char one[32] = "";
        int length = 0;
        for (bool ends = !*format; !ends && length < (int)sizeof one - 12; format++) {
            ends = strchr("defgs", *format);
            length += *format == '*' ? snprintf(one + length, 12, "%d", va_arg(list, int))
                                     : snprintf(one + length, 2, "%c", *format);
        }
        char kind = length > 0 ? one[length - 1] : '\0';
        double x = kind && strchr("efg", kind) ? va_arg(list, double) : 0;
        const bool is_long = kind == 'd' && one[length - 2] == 'l';
        const long number = kind != 'd' ? 0 : is_long ? va_arg(list, long) : va_arg(list, int);
        if (kind == 'd' && !is_long)
            memcpy(one + length - 1, "ld", sizeof "ld");
        if (kind == 's')
            kmp_text_printf(text, one, va_arg(list, const char *));
        else if (kind == 'd')
            kmp_text_printf(text, one, number);
        else if (kind && isfinite(x))
            kmp_text_printf(text, one, rounds_to_zero(one, x) ? 0.0 : x);
        else if (kind)
            kmp_text_printf(text, "%*s", atoi(one + 1), "-");
    }
    va_end(list);
}

int kmp_print_width(const kempe_system *system, kmp_quantity quantity)
{
    int width = 0;
    for (int k = 0; k < kmp_quantity_size(system, quantity); k++) {
        int length = (int)strlen(kmp_quantity_name(system, quantity, k));
        width = length > width ? length : width;
    }
    return width;
}

double kmp_print_clean(double x, double noise)
{
    return fabs(x) <= noise ? 0 : x;
}

/* Of a rotation, or of a translation by the characteristic length, with seconds; or rounding of the largest value. */
static double noise_of(const kempe_system *system, const double *x)
{
    double largest = 0;
    for (int k = 0; k < kmp_model_coordinates(system->model); k++)
        largest = fmax(largest, fabs(x[k]) / system->scale[k]);
    return fmax(KMP_PRINT_NOISE, 10 * DBL_EPSILON * largest);
}

void kmp_print_coordinates(kmp_text *text, const kempe_system *system, int count, const kmp_coordinate_column *columns,
                           kmp_mark_fn *mark, const void *self)
{
    const kempe_model *model = system->model;
    const int width = kmp_print_width(system, KMP_QUANTITY_Q);
    double noise[KMP_PRINT_COLUMNS];
    kmp_text_printf(text, "  %-*s", width, "");
    for (int i = 0; i < count; i++) {
        kmp_text_printf(text, "  %12s", columns[i].title);
        noise[i] = noise_of(system, columns[i].value);
    }
    kmp_text_put(text, "\n");
    for (int k = 0; k < kmp_model_coordinates(model); k++) {
        kmp_text_printf(text, "  %-*s", width, model->motions[k].name);
        for (int i = 0; i < count; i++) {
            const double x = kmp_print_clean(columns[i].value[k], system->scale[k] * noise[i]);
            kmp_text_printf(text, "  %12.6g", kmp_print_value(system, k, x));
        }
        /* Each unit once. */
        const char *last = "";
        for (const kmp_coordinate_column *c = columns; c < columns + count; c++) {
            const char *unit = kmp_shown_as(system->context, kmp_quantity_unit(system, c->quantity, k)).unit;
            if (strcmp(unit, last) != 0)
                kmp_text_printf(text, "%s%s", c == columns ? "  " : ", ", unit);
            last = unit;
        }
        const char *said = mark ? mark(self, k) : "";
        kmp_text_printf(text, "%s%s\n", *said ? "  " : "", said);
    }
}

void kmp_print_states(kmp_text *text, const kempe_system *system, const double *qd, const double *qdd)
{
    const kempe_model *model = system->model;
    const int width = kmp_print_width(system, KMP_QUANTITY_STATE), first = kmp_model_coordinates(model);
    if (model->state_count > 0)
        kmp_text_printf(text, "  %-*s  %12s%s\n", width, "", "state", qdd ? "          rate" : "");
    for (int k = 0; k < model->state_count; k++) {
        kmp_text_printf(text, "  %-*s  %12.6g", width, model->states[k].name, qd[first + k] + 0.0);
        if (qdd)
            kmp_text_printf(text, "  %12.6g", qdd[first + k] + 0.0);
        const char *unit = kmp_print_unknown(system->context, "");
        kmp_text_printf(text, "%s%s\n", *unit ? "  " : "", unit);
    }
}

void kmp_print_multipliers(kmp_text *text, const kempe_system *system, const double *lambda)
{
    const int width = kmp_print_width(system, KMP_QUANTITY_LAMBDA);
    double largest = 0;
    if (system->m > 0)
        kmp_text_printf(text, "\n  %-*s  %12s\n", width, "", "multiplier");
    /* As forces: multipliers of rows in rad act at the characteristic length. */
    for (int r = 0; r < system->m; r++)
        largest = fmax(largest, fabs(lambda[r]) * pow(system->length, system->rows[r].length_power - 1));
    for (int r = 0; r < system->m; r++) {
        double noise = KMP_PRINT_NOISE * largest * pow(system->length, 1 - system->rows[r].length_power);
        const kmp_shown as = kmp_shown_as(system->context, kmp_quantity_unit(system, KMP_QUANTITY_LAMBDA, r));
        kmp_text_printf(text, "  %-*s  %12.6g  %s\n", width, system->row_names[r],
                        as.factor * kmp_print_clean(lambda[r], noise), as.unit);
    }
}

void kmp_print_outputs(kmp_text *text, const kempe_model *model, const double *x)
{
    kmp_text column = {0};
    const char *before = "\n";
    for (int o = 0; o < model->output_count; o++) {
        const kmp_output *output = &model->outputs[o];
        const int width = kmp_output_width(model, output);
        if (width == 0)
            continue;
        kmp_text line = {0};
        kmp_text_put(text, before);
        before = "";
        kmp_output_print(&line, model, output);
        for (int k = 0; k < width; k++) {
            /* Each unit after the values that have it. */
            const char *unit = kmp_output_unit(model, output, k), *part = NULL;
            double largest = 0;
            for (int i = 0; i < width; i++)
                largest = strcmp(kmp_output_unit(model, output, i), unit) == 0 ? fmax(largest, fabs(x[i])) : largest;
            kmp_shown as = kmp_shown_as(model->context, unit);
            bool last = k + 1 == width || strcmp(unit, kmp_output_unit(model, output, k + 1)) != 0;
            kmp_text_free(&column);
            kmp_output_column(&column, model, output, k);
            part = width > 1 && column.s ? strrchr(column.s, '.') : NULL;
            if (part && output->kind == KMP_OUTPUT_BEARING && k < KMP_BEARING_VALUES - 1)
                part -= 2; /* ".1.x" */
            const char *name = output->kind == KMP_OUTPUT_SENSOR ? kmp_print_unknown(model->context, unit) : as.unit;
            kmp_text_printf(&line, "  %s%s%.6g%s%s", part ? part + 1 : "", part ? " " : "",
                            as.factor * kmp_print_clean(x[k], KMP_PRINT_NOISE * largest), last && *name ? " " : "",
                            last ? name : "");
        }
        kmp_print_wrapped(text, "  ", 6, line.s ? line.s : "");
        kmp_text_free_part(text, &line);
        x += width;
    }
    text->failed = text->failed || column.failed;
    kmp_text_free(&column);
}

void kmp_print_outputs_json(kmp_json *json, const kempe_model *model, const double *x, bool positions)
{
    kmp_json_object(json, positions ? "position" : "outputs");
    for (int o = 0; o < model->output_count; o++) {
        const kmp_output *output = &model->outputs[o];
        int width = kmp_output_width(model, output);
        kmp_text name = {0};
        kmp_output_print(&name, model, output);
        size_t head = positions ? strlen("position(") : 0;
        if (positions && !name.failed)
            name.s[name.length - 1] = '\0'; /* the closing parenthesis */
        bool shows = !name.failed && width > 0 && (!positions || output->kind == KMP_OUTPUT_POSITION);
        for (int k = 0; k < o; k++) /* keys must be unique */
            shows = shows && !kmp_output_equal(&model->outputs[k], output);
        if (shows && width == 1)
            kmp_json_number(json, name.s + head, x[0]);
        else if (shows)
            kmp_json_numbers(json, name.s + head, width, x);
        kmp_text_free_part(json->text, &name);
        x += width;
    }
    kmp_json_end(json);
}

const char *kmp_print_unit(const kempe_system *system, int coordinate)
{
    return kmp_shown_as(system->context, kmp_quantity_unit(system, KMP_QUANTITY_Q, coordinate)).unit;
}

double kmp_print_value(const kempe_system *system, int coordinate, double x)
{
    return kmp_shown_as(system->context, kmp_quantity_unit(system, KMP_QUANTITY_Q, coordinate)).factor * x;
}

const char *kmp_print_unknown(const kempe_context *context, const char *unit)
{
    return *unit || kmp_shown_as(context, "m").factor == 1 ? unit : "SI";
}

kmp_shown kmp_print_customary(const kempe_context *context, const char *unit, kmp_shown customary)
{
    const kmp_shown as = kmp_shown_as(context, unit);
    return as.factor == 1 ? customary : as;
}

void kmp_print_quantity(kmp_text *text, const kempe_context *context, int digits, double x, const char *unit)
{
    const kmp_shown as = kmp_shown_as(context, unit);
    if (isfinite(x))
        kmp_text_printf(text, "%.*g%s%s", digits, as.factor * x + 0.0, *as.unit ? " " : "", as.unit);
    else
        kmp_text_put(text, "-");
}

kempe_status kmp_print_finish(kempe_context *context, kmp_text *text, char **out)
{
    char *s = kmp_text_take(text);
    KMP_TRY(kmp_made(context, s));
    *out = s;
    return KEMPE_OK;
}

kempe_status kmp_print_result(kempe_context *context, kempe_format format, kmp_put_fn *put, const void *result,
                              char **text)
{
    KMP_WANTED(context, text, "text");
    kmp_text out = {0};
    kmp_context_clear(context);
    const kmp_shown_in shown = kmp_context_show_in(context, (kmp_shown_in){0});
    if (format != KEMPE_JSON)
        (void)kmp_context_show_in(context, shown);
    put(&out, result);
    (void)kmp_context_show_in(context, shown);
    return kmp_print_finish(context, &out, text);
}
