/* SPDX-License-Identifier: BSD-3-Clause */
/* Each model is read again with its bodies changed, and simulated by the default method, in a separate context: its
 * doubts are of its row. Outputs are compared at the instants that its table shares with the reference. */
#include "studies/compare/compare_bodies.h"
#include "base/context.h"
#include "model/data/model.h"
#include "model/read/body_models.h"
#include "model/read/reader.h"
#include "output/print.h"
#include "studies/simulate/trajectory.h"
#include <kempe/table.h>
#include <math.h>
#include <string.h>

/* Instants of a run, tolerance of all of them, repeats of the timed runs. */
enum { INSTANTS = 400, REPEATS = 3 };
#define RTOL 1e-8

/* A row with what is freed at the end. */
typedef struct entry {
    kempe_context *context;
    kempe_model *model;
    kempe_system *system;
    kempe_trajectory *trajectory;
    kempe_table *table;
} entry;

static void free_entry(entry *e)
{
    kempe_table_free(e->table);
    kempe_trajectory_free(e->trajectory);
    kempe_system_free(e->system);
    kempe_model_free(e->model);
    kempe_context_free(e->context);
    *e = (entry){0};
}

/* KEMPE_E_INPUT: the sentences of the reader, and which model they are of. */
static kempe_status read_entry(const kempe_model *model, const char *word, entry *e)
{
    kempe_context *context = model->context;
    *e = (entry){.context = kmp_context_new_below(context)};
    KMP_TRY(kmp_made(context, e->context));
    (void)kmp_context_show_in(e->context, (kmp_shown_in){0}); /* errors are kept in SI */
    kempe_status status = kmp_model_read_as(e->context, model->source.file, model->source.settings,
                                            model->source.setting_count, word, &e->model);
    if (status == KEMPE_OK)
        return status;
    /* A sentence each. */
    for (const char *at = kempe_context_message(e->context); *at; at += strspn(at, "\n")) {
        const int length = (int)strcspn(at, "\n");
        (void)kmp_fail(context, status, "%.*s", length, at);
        at += length;
    }
    return kmp_fail(context, status, "%s: so the model cannot be compared with the bodies '%s'", model->source.file,
                    word);
}

/* -- the list ---------------------------------------------------------------------------------------- */

static kempe_status read_words(const kempe_model *model, const char *list, kmp_arena *arena, kmp_bodies_table *table)
{
    table->rows = KMP_ARENA_NEW(arena, kmp_compared_bodies, strlen(list) + 1);
    KMP_TRY(kmp_made(model->context, table->rows));
    for (const char *at = list; at;) {
        at += strspn(at, " ");
        size_t whole = strcspn(at, ","), length = whole;
        while (length > 0 && at[length - 1] == ' ')
            length--;
        const char *word = kmp_arena_printf(arena, "%.*s", (int)length, at);
        KMP_TRY(kmp_made(model->context, word));
        if (!kmp_is_body_model(word))
            return kmp_fail(model->context, KEMPE_E_ARGUMENT,
                            "bodies '%s': rigid, none, first, full or segments:N is expected, separated by commas",
                            word);
        for (int k = 0; k < table->count; k++)
            if (strcmp(table->rows[k].word, word) == 0)
                return kmp_fail(model->context, KEMPE_E_ARGUMENT, "bodies '%s' are given twice", word);
        table->rows[table->count++] = (kmp_compared_bodies){.word = word, .reason = "", .worst = -1, .part = NAN};
        at = at[whole] ? at + whole + 1 : NULL;
    }
    if (table->count >= 2)
        return KEMPE_OK;
    return kmp_fail(model->context, KEMPE_E_ARGUMENT,
                    "bodies '%s': name at least two, the finest one last, with which the others are compared", list);
}

kempe_status kmp_compare_bodies_begin(const kempe_model *model, const char *list, kmp_arena *arena,
                                      kmp_bodies_table *table)
{
    *table = (kmp_bodies_table){.rtol = RTOL};
    if (!list)
        return KEMPE_OK;
    KMP_TRY(read_words(model, list, arena, table));
    if (!model->source.from_file)
        return kmp_fail(model->context, KEMPE_E_ARGUMENT, "bodies '%s': a model from a file is expected", list);
    int flexible = 0;
    for (int k = 0; k < table->count; k++) {
        entry e;
        kempe_status status = read_entry(model, table->rows[k].word, &e);
        const bool outputs = status == KEMPE_OK && e.model->output_count > 0;
        flexible += status == KEMPE_OK && e.model->motion_count != model->motion_count;
        free_entry(&e);
        KMP_TRY(status);
        if (!outputs)
            return kmp_fail(model->context, KEMPE_E_ARGUMENT,
                            "bodies '%s': the run of model '%s' has no outputs that every model of its bodies has: "
                            "request some, such as position(BODY.POINT)",
                            table->rows[k].word, model->name);
    }
    if (flexible > 0 || model->flexible_count > 0)
        return KEMPE_OK;
    return kmp_fail(model->context, KEMPE_E_ARGUMENT, "bodies '%s': model '%s' has no flexible bodies", list,
                    model->name);
}

/* -- runs -------------------------------------------------------------------------------------------- */

static const char *first_line(kmp_arena *arena, const char *text)
{
    return kmp_arena_printf(arena, "%.*s", (int)strcspn(text, "\n"), text);
}

/* Its trajectory and table, where it has them. */
static kempe_status run_entry(entry *e, kempe_context *context, double t_end, kmp_arena *arena,
                              kmp_compared_bodies *row)
{
    const kempe_run_options options = {.size = sizeof options,
                                       .t_end = t_end,
                                       .output_step = t_end / INSTANTS,
                                       .rtol = RTOL,
                                       .no_convergence_check = 1};
    kempe_status status = kempe_system_new(e->model, &e->system);
    row->cpu_s = row->build_s = NAN;
    for (int k = 0; status == KEMPE_OK && k < REPEATS; k++) {
        kempe_trajectory_free(e->trajectory);
        e->trajectory = NULL;
        status = kempe_simulate(e->system, &options, &e->trajectory);
        if (e->trajectory)
            row->cpu_s = fmin(row->cpu_s, e->trajectory->report.cpu_s);
    }
    if (status == KEMPE_E_MEMORY)
        return kmp_fail_memory(context);
    if (kmp_interrupted(context))
        return KEMPE_STOPPED;
    row->outcome = e->trajectory ? kempe_trajectory_outcome(e->trajectory) : kmp_outcome_of(status);
    if (e->system) {
        row->build_s = e->system->build_s;
        row->coordinates = e->system->n;
    }
    if (e->trajectory) {
        row->steps = e->trajectory->report.steps;
        row->reason = first_line(arena, status == KEMPE_UNTRUSTED ? e->trajectory->warnings : e->trajectory->reason);
        status = kempe_trajectory_table(e->trajectory, "rows", &e->table);
    } else {
        row->reason = first_line(arena, kempe_context_message(e->context));
    }
    return status == KEMPE_E_MEMORY ? kmp_fail_memory(context) : kmp_made(context, row->reason);
}

/* -- errors ------------------------------------------------------------------------------------------ */

/* The outputs of a unit share one range: a component that is zero has no separate range. */
static kempe_status take_outputs(const entry *reference, kempe_context *context, kmp_arena *arena,
                                 kmp_bodies_table *table)
{
    const kempe_table *rows = reference->table;
    const int count = table->output_count = kempe_table_column_count(rows) - 1;
    if (!KMP_ARENA_MAKE(arena, KMP_ROOM(const char *, count, &table->names),
                        KMP_ROOM(const char *, count, &table->unit), KMP_ROOM(double, count, &table->range)))
        return kmp_fail_memory(context);
    for (int k = 0; k < count; k++) {
        double low = INFINITY, high = -INFINITY;
        for (int row = 0; row < kempe_table_row_count(rows); row++) {
            low = fmin(low, kempe_table_number(rows, row, k + 1));
            high = fmax(high, kempe_table_number(rows, row, k + 1));
        }
        table->names[k] = kmp_arena_strdup(arena, kempe_table_column_name(rows, k + 1));
        table->unit[k] = kmp_arena_strdup(arena, kempe_table_unit(rows, k + 1));
        table->range[k] = high - low;
        KMP_TRY(kmp_made(context, table->names[k] && table->unit[k]));
    }
    for (int k = 0; k < count; k++)
        for (int i = 0; i < count; i++)
            if (strcmp(table->unit[i], table->unit[k]) == 0)
                table->range[k] = fmax(table->range[k], table->range[i]);
    return KEMPE_OK;
}

/* The largest difference of a column where the times are the same. */
static double difference(const kempe_table *a, const kempe_table *b, int column)
{
    double most = NAN;
    for (int i = 0, k = 0; i < kempe_table_row_count(a) && k < kempe_table_row_count(b);) {
        const double t = kempe_table_number(a, i, 0), other = kempe_table_number(b, k, 0);
        if (t == other)
            most = fmax(most, fabs(kempe_table_number(a, i, column) - kempe_table_number(b, k, column)));
        i += t <= other;
        k += other <= t;
    }
    return most;
}

static kempe_status take_errors(const entry *e, const entry *reference, kempe_context *context, kmp_arena *arena,
                                kmp_bodies_table *table, kmp_compared_bodies *row)
{
    if (!e->table || kempe_table_column_count(e->table) != table->output_count + 1)
        return KEMPE_OK;
    row->error = KMP_ARENA_NEW(arena, double, table->output_count);
    KMP_TRY(kmp_made(context, row->error));
    const bool divided = strchr(row->word, ':'); /* names of points are with the names of the pieces then */
    for (int k = 0; k < table->output_count; k++) {
        row->error[k] = difference(e->table, reference->table, k + 1);
        if (!divided && !(table->names[k] = kmp_arena_strdup(arena, kempe_table_column_name(e->table, k + 1))))
            return kmp_fail_memory(context);
        const double part = row->error[k] > 0 ? row->error[k] / table->range[k] : row->error[k];
        if (!(part <= row->part)) {
            row->part = part;
            row->worst = k;
        }
    }
    return KEMPE_OK;
}

static bool is_good(const kmp_compared_bodies *row)
{
    return row->outcome == KEMPE_OUTCOME_COMPLETE || row->outcome == KEMPE_OUTCOME_NOT_CHECKED;
}

void kmp_compare_bodies_put_doubt(kmp_text *text, const kmp_bodies_table *table)
{
    const kmp_compared_bodies *last = table->count > 0 ? &table->rows[table->count - 1] : NULL;
    if (last && !is_good(last))
        kmp_text_printf(text, "bodies '%s', which the others are compared with: %s: %s", last->word,
                        kempe_outcome_text(last->outcome), last->reason);
}

kempe_status kmp_compare_bodies(const kempe_model *model, double t_end, kmp_arena *arena, kmp_bodies_table *table)
{
    kempe_context *context = model->context;
    entry reference = {0};
    kempe_status status = KEMPE_OK;
    for (int k = table->count - 1; k >= 0 && status == KEMPE_OK; k--) {
        kmp_compared_bodies *row = &table->rows[k];
        entry e;
        kmp_log(context, KEMPE_LOG_PROGRESS, "bodies: %s", row->word);
        status = read_entry(model, row->word, &e);
        if (status == KEMPE_OK)
            status = run_entry(&e, context, t_end, arena, row);
        if (k == table->count - 1) {
            reference = e;
            if (status == KEMPE_OK && reference.table)
                status = take_outputs(&reference, context, arena, table);
            continue;
        }
        if (status == KEMPE_OK && reference.table)
            status = take_errors(&e, &reference, context, arena, table, row);
        free_entry(&e);
    }
    free_entry(&reference);
    kmp_text doubt = {0};
    kmp_compare_bodies_put_doubt(&doubt, table);
    if (status == KEMPE_OK && doubt.length > 0)
        kmp_doubt(context, "%s", doubt.s);
    if (doubt.failed)
        status = kmp_fail_memory(context);
    kmp_text_free(&doubt);
    return status;
}

/* -- shown ------------------------------------------------------------------------------------------- */

enum { NAME = 14 };

/* The largest error of each unit, in the order of the outputs. */
static void show_errors(kmp_text *text, const kempe_context *context, const kmp_bodies_table *table,
                        const kmp_compared_bodies *row)
{
    for (int k = 0; k < table->output_count; k++) {
        int first = 0, worst = k;
        while (strcmp(table->unit[first], table->unit[k]) != 0)
            first++;
        for (int i = k; i < table->output_count; i++)
            if (strcmp(table->unit[i], table->unit[k]) == 0 && !(row->error[i] <= row->error[worst]))
                worst = i;
        if (first != k)
            continue;
        kmp_text_put(text, k > 0 ? "; " : " ");
        kmp_print_quantity(text, context, 2, row->error[worst], kmp_print_unknown(context, table->unit[worst]));
        kmp_text_printf(text, ", %s", table->names[worst]);
    }
}

void kmp_compare_bodies_show(kmp_text *text, const kempe_context *context, const kmp_bodies_table *table)
{
    if (table->count == 0)
        return;
    const kmp_compared_bodies *last = &table->rows[table->count - 1];
    kmp_text_printf(text, "\nModels of the flexible bodies at rtol %g, compared with the last one, '%s'\n", table->rtol,
                    last->word);
    kmp_text_printf(text, "%-*s %9s %9s %6s %7s  %s\n", NAME, "bodies", "ms", "prep. ms", "coord.", "steps",
                    "largest error of outputs of a unit");
    for (int k = 0; k < table->count; k++) {
        const kmp_compared_bodies *row = &table->rows[k];
        kmp_text_printf(text, "%-*s %9.3g %9.3g %6d %7ld ", NAME, row->word, 1e3 * row->cpu_s, 1e3 * row->build_s,
                        row->coordinates, row->steps);
        if (row == last && table->output_count > 0)
            kmp_text_put(text, " the reference");
        else if (row->error)
            show_errors(text, context, table, row);
        kmp_text_put(text, "\n");
        if (!is_good(row))
            kmp_text_printf(text, "%-*s %s: %s\n", NAME, "", kempe_outcome_text(row->outcome), row->reason);
    }
}

void kmp_compare_bodies_json(kmp_json *json, const kempe_context *context, const kmp_bodies_table *table)
{
    if (table->count == 0)
        return;
    kmp_json_put(json, "bodies { rtol %g reference %s rows [", table->rtol, table->rows[table->count - 1].word);
    for (int k = 0; k < table->count; k++) {
        const kmp_compared_bodies *row = &table->rows[k];
        kmp_json_put(json, "{ bodies %s status %s reason %s coordinates %d steps %ld cpu_s %g build_s %g", row->word,
                     kempe_outcome_text(row->outcome), row->reason, row->coordinates, row->steps, row->cpu_s,
                     row->build_s);
        if (row->worst >= 0)
            kmp_json_put(json, "worst %s part %g", table->names[row->worst], row->part);
        kmp_json_array(json, "outputs");
        for (int i = 0; row->error && i < table->output_count; i++) {
            const kmp_shown as = kmp_shown_as(context, table->unit[i]);
            kmp_json_put(json, "{ name %s unit %s error %g range %g }", table->names[i], as.unit,
                         as.factor * row->error[i], as.factor * table->range[i]);
        }
        kmp_json_put(json, "] }");
    }
    kmp_json_put(json, "] }");
}
