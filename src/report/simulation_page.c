/* SPDX-License-Identifier: BSD-3-Clause */
/* The report of a simulation: the run once more with monitoring, and all its outputs. */
#include "base/memory.h"
#include "model/data/model.h"
#include "model/read/loads.h"
#include "output/print.h"
#include "output/result_table.h"
#include "report/motion_picture.h"
#include "report/result_page.h"
#include "report/vehicle_drawing.h"
#include "studies/simulate/observed.h"
#include "studies/simulate/trajectory_print.h"
#include <kempe/compare.h>
#include <math.h>
#include <string.h>

/* Rows of the page: at least so many, with the path of a journal so many, at most so many where the table has more; how
 * many times as many the run is repeated with; columns of all outputs. */
enum { FEWEST_ROWS = 1000, PATH_ROWS = 6000, MOST_ROWS = 4000, MOST_DENSER = 1000, MOST_COLUMNS = 300 };

typedef struct maker {
    kempe_trajectory *t;
    kmp_record record, start; /* of the run; of the start where that has no row */
    kmp_output_program observed;
    kmp_columns own; /* of the model's own outputs */
    kempe_table *table;
    kempe_comfort *comfort; /* of a vehicle; NULL: none */
    const char *first[KMP_PAGE_FIRST];
    int first_count;
    char *text;
} maker;

/* -- the run once more ------------------------------------------------------------------------------- */

/* A multiple of the rows of the table, so that its times are among those of the page. */
static int choose_rows(const kempe_trajectory *t)
{
    int rows = kmp_is_complete(t->status) ? t->table.rows - 1 : 0;
    bool path = kmp_contact_drawing_has_paths(t->system->model);
    int fewest = path ? PATH_ROWS : FEWEST_ROWS, most = path ? PATH_ROWS : MOST_ROWS;
    if (rows < 1)
        return fewest;
    return rows >= most ? most : rows * ((fewest + rows - 1) / rows);
}

/* The state that a run continued from, as a start; without one the model is assembled. */
static bool take_start(const kempe_trajectory *t, double *room, kempe_assembly *start)
{
    int n = t->system->n, row = 0;
    if (!(t->spec.t_start > 0))
        return false;
    while (row + 1 < t->table.rows && kmp_samples_time(&t->table, row) < t->spec.t_start)
        row++;
    memcpy(room, kmp_samples_get(&t->table, KMP_QUANTITY_Q, row), (size_t)n * sizeof *room);
    memcpy(room + n, kmp_samples_get(&t->table, KMP_QUANTITY_QD, row), (size_t)n * sizeof *room);
    *start = (kempe_assembly){.system = t->system, .q = room, .qd = room + n, .closed = true};
    return true;
}

/* One that the user interrupted goes as far as it came. */
static kempe_status record_rows(const maker *w, int rows, kmp_record *record)
{
    const kempe_trajectory *t = w->t;
    kmp_run_spec spec = t->spec;
    kempe_assembly start = {0};
    double *room = KMP_NEW(double, 2 * t->system->n);
    KMP_TRY(kmp_made(t->system->context, room));
    if (t->interrupted)
        spec.t_end = t->report.t;
    bool given = take_start(t, room, &start);
    kmp_log(t->system->context, KEMPE_LOG_PROGRESS, "report: the run is repeated");
    const bool quiet = kmp_context_quiet(t->system->context, true);
    kempe_status status = kmp_record_run(t->system, &spec, given ? &start : NULL, rows, record);
    (void)kmp_context_quiet(t->system->context, quiet);
    kmp_free(room);
    return kmp_has_result(status) ? KEMPE_OK : status;
}

/* More rows where a joint turns too far between two of them to be followed, or where the run ends early. */
static kempe_status record_run(maker *w)
{
    const kempe_model *model = w->t->system->model;
    int rows = choose_rows(w->t), most = kmp_motion_picture_frames(model);
    KMP_TRY(record_rows(w, rows, &w->record));
    const kmp_samples *row = &w->record.row;
    if (row->rows == 0)
        return KEMPE_OK;
    double followed = kmp_motion_picture_end(model, &w->record);
    double last = kmp_samples_time(row, row->rows - 1);
    double span = w->t->spec.t_end - w->t->spec.t_start, lasted = last - w->t->spec.t_start;
    double early = row->rows < FEWEST_ROWS && lasted > 0 ? ceil(span / lasted) : 1;
    int factor = (int)fmin(fmax(early, followed > 0 ? ceil(last / followed) : 1), MOST_DENSER);
    factor = (long)factor * row->rows < most ? factor : most / row->rows;
    if (factor < 2)
        return KEMPE_OK;
    kmp_record_free(&w->record);
    return record_rows(w, factor * rows, &w->record);
}

/* -- outputs ----------------------------------------------------------------------------------------- */

static kempe_status fill_table(maker *w)
{
    const kmp_columns *columns = &w->observed.columns;
    const kmp_samples *rows = &w->record.row;
    const kempe_model *model = w->t->system->model;
    kempe_context *context = w->t->system->context;
    kempe_table *table = kmp_tabulate(context, "outputs");
    double *values = KMP_NEW(double, columns->count);
    for (int k = 0; k < columns->count; k++)
        kmp_tabulate_column(table, columns->unit[k], "%s", columns->name[k]);
    kmp_tabulate_column(table, "J", "energy.work");
    for (int k = 0; k < kmp_model_given_inputs(model); k++)
        kmp_tabulate_column(table, model->inputs[k].unit, "input.%s", model->inputs[k].name);
    for (int row = 0; values && row < rows->rows; row++) {
        kmp_output_program_fill(&w->observed, rows, row, values);
        kmp_tabulate_row(table);
        kmp_tabulate_numbers(table, columns->count, values);
        kmp_tabulate_number(table, kmp_samples_work(rows, row));
        for (int k = 0; k < kmp_model_given_inputs(model); k++)
            kmp_tabulate_number(table, kmp_signal_value(&model->inputs[k].signal, kmp_samples_time(rows, row)) /
                                           model->inputs[k].si);
    }
    if (!values)
        kmp_tabulate_fail(table);
    kmp_free(values);
    return kmp_tabulate_finish(context, table, &w->table);
}

/* Of many outputs rates, accelerations and multipliers are left to the reader's choice. */
static bool is_secondary(const char *name)
{
    return strncmp(name, "qd.", 3) == 0 || strncmp(name, "qdd.", 4) == 0 || strncmp(name, "lambda.", 7) == 0;
}

static kempe_status make(maker *w)
{
    const kempe_system *system = w->t->system;
    KMP_TRY(kmp_vehicle_comfort(w->t, &w->comfort));
    KMP_TRY(record_run(w));
    KMP_TRY(kmp_output_program_init(&w->observed, system, NULL, MOST_COLUMNS, NULL));
    KMP_TRY(fill_table(w));
    /* The outputs that the model requests, as far as they are few. */
    KMP_TRY(kmp_made(w->t->system->context, kmp_columns_init(&w->own, w->t->system, w->t->system->model, NULL)));
    bool few = w->own.count - 1 <= KMP_PAGE_FIRST;
    int most = few ? KMP_PAGE_FIRST : KMP_PAGE_FIRST / 2;
    for (int k = 1; k < w->own.count && w->first_count < most; k++)
        if (few || !is_secondary(w->own.name[k]))
            w->first[w->first_count++] = w->own.name[k];
    for (int k = 1; k < w->own.count && w->first_count == 0; k++)
        w->first[w->first_count++] = w->own.name[k];
    if (w->record.row.rows == 0)
        KMP_TRY(kmp_record_start(system, &w->start));
    kmp_context_clear(system->context); /* a run that fails has failed again */
    return kempe_trajectory_print(w->t, KEMPE_TEXT, &w->text);
}

/* -- words ------------------------------------------------------------------------------------------- */

static const char *answer_of(const kempe_trajectory *t, kmp_arena *arena)
{
    if (kmp_is_complete(t->status))
        return t->report.requested ? kmp_arena_printf(arena, "ended as requested at t = %.6g s", t->report.t)
                                   : kmp_arena_printf(arena, "%.6g to %.6g s", t->spec.t_start, t->spec.t_end);
    return kmp_arena_printf(arena, "at t = %.6g s", t->report.t);
}

static void add_fact(kmp_result_page *page, kmp_arena *arena, const char *name, double x, const char *format)
{
    const char *value = isfinite(x) ? kmp_arena_printf(arena, format, x) : "-";
    page->fact[page->fact_count++] = (kmp_page_fact){name, value};
}

/* The convergence check without its label. */
static const char *sentences_of(const kempe_trajectory *t, kmp_arena *arena)
{
    kmp_text text = {0};
    const char *name = t->system->n > 0 ? t->system->model->motions[t->again.index].name : NULL;
    kmp_convergence_show(&text, t->system->context, &t->again, "the state", name, kmp_trajectory_unit(t));
    const char *words = kmp_text_keep(&text, arena);
    if (!words)
        return NULL;
    size_t label = strcspn(words, " ");
    return *words ? kmp_arena_printf(arena, "Repeated%s", words + label + strspn(words + label, " ") - 1) : "";
}

static kempe_status write_page(maker *w, kmp_arena *arena, const char *path)
{
    const kempe_trajectory *t = w->t;
    kmp_result_page page = {
        .system = t->system,
        .command = "simulate",
        .subject = "simulation",
        .scene = kmp_arena_printf(arena, "%s%s%s %s, rtol %g \xc2\xb7 %d coordinate%s, %d closure row%s",
                                  t->spec.formulation, t->spec.form ? " " : "", t->spec.form ? t->spec.form : "",
                                  t->integrator, t->spec.rtol, t->system->n, t->system->n == 1 ? "" : "s", t->system->m,
                                  t->system->m == 1 ? "" : "s"),
        .answer = answer_of(t, arena),
        .status = t->status,
        .word = kmp_trajectory_word(t),
        .reason = t->reason,
        .locked = !kmp_is_complete(t->status) && !t->interrupted,
        .warnings = t->warnings,
        .sentences = sentences_of(t, arena),
        .text = w->text,
        .table = w->table,
        .x = "t",
        .first = w->first,
        .first_count = w->first_count,
        .left_out = w->observed.left_out,
        .frames = w->record.row.rows > 0 ? &w->record.row : &w->start.row,
        .record = &w->record,
        .comfort = w->comfort,
        .contacts = t};
    add_fact(&page, arena, "energy balance", t->verdict.drift_rel, "%.1e");
    add_fact(&page, arena, "closure residual", t->verdict.h_max, "%.1e");
    add_fact(&page, arena, t->again.known ? "repeated run differs by" : "steps",
             t->again.known ? t->again.difference : (double)t->report.steps, t->again.known ? "%.1e" : "%.0f");
    return arena->failed ? kmp_fail_memory(t->system->context) : kmp_result_page_write(&page, path);
}

kempe_status kempe_trajectory_write_report(kempe_trajectory *trajectory, const char *path)
{
    KMP_WANTED(NULL, trajectory, "trajectory");
    KMP_WANTED(trajectory->system->context, path, "path");
    maker w = {.t = trajectory};
    kmp_arena arena = {0};
    kmp_model_begin(trajectory->system->model);
    KMP_TRY(kempe_report_check(trajectory->system->context));
    kempe_status status = make(&w);
    if (status == KEMPE_OK)
        status = write_page(&w, &arena, path);
    kmp_record_free(&w.record);
    kmp_record_free(&w.start);
    kmp_output_program_free(&w.observed);
    kmp_columns_free(&w.own);
    kempe_table_free(w.table);
    kempe_comfort_free(w.comfort);
    kempe_text_free(w.text);
    kmp_arena_free(&arena);
    return status;
}
