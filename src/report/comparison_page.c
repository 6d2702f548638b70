/* SPDX-License-Identifier: BSD-3-Clause */
/* The report of a comparison: runs made once more, and the page with them. Its data: the comparison, the runs in
 * detail, the picture. */
#include "report/comparison_page.h"
#include "base/memory.h"
#include "model/data/model.h"
#include "model/read/loads.h"
#include "report/motion_picture.h"
#include "report/page.h"
#include "studies/compare/compare_advice.h"
#include "studies/compare/compare_print.h"
#include "studies/compare/compare_study.h"
#include <kempe/compare.h>
#include <math.h>
#include <string.h>

/* -- choice of runs ---------------------------------------------------------------------------------- */

/* The better of two runs of a formulation: one that reaches the level of the advice, then the cheaper one. Without
 * such, the more accurate one; without errors, the one at the tighter tolerance. */
static bool is_better(const kempe_comparison *c, int run, int than)
{
    if (than < 0)
        return true;
    const kmp_compared *a = &c->runs[run], *b = &c->runs[than];
    double e = a->verdict.error[KMP_QUANTITY_Q], f = b->verdict.error[KMP_QUANTITY_Q], level = c->advice.level;
    if ((e <= level) != (f <= level))
        return e <= level;
    if (e <= level)
        return a->cpu_s < b->cpu_s;
    return isnan(e) || isnan(f) ? a->rtol < b->rtol : e < f;
}

static int best_of(const kempe_comparison *c, const char *formulation)
{
    int best = -1;
    for (int k = 0; k < c->count; k++)
        if (c->runs[k].status == KEMPE_OK && strcmp(c->runs[k].method->formulation, formulation) == 0 &&
            is_better(c, k, best))
            best = k;
    return best;
}

int kmp_page_choose(const kempe_comparison *c, int *chosen)
{
    int count = 0;
    if (c->advice.run >= 0)
        chosen[count++] = c->advice.run;
    for (int w = 0; w < c->method_count; w++) {
        bool seen = false;
        for (int k = 0; k < count && !seen; k++)
            seen = strcmp(c->runs[chosen[k]].method->formulation, c->methods[w].formulation) == 0;
        int best = seen ? -1 : best_of(c, c->methods[w].formulation);
        if (best >= 0)
            chosen[count++] = best;
    }
    return count;
}

/* -- the comparison ---------------------------------------------------------------------------------- */

static const char *or_empty(const char *s)
{
    return s ? s : "";
}

static void put_run(kmp_json *json, const kempe_comparison *c, const kmp_compared *run)
{
    double error[KMP_COMPARE_SHOWN];
    for (int k = 0; k < KMP_COMPARE_SHOWN; k++)
        error[k] = kmp_compare_error(c, run, kmp_compare_shown[k]);
    kmp_json_put(json, "{ method %ld rtol %.6g status %s reason %s left_out %i", run->method - c->methods, run->rtol,
                 kempe_outcome_text(kmp_outcome_of(run->status)), or_empty(run->reason), run->left_out);
    kmp_json_rounded_numbers(json, "error", KMP_COMPARE_SHOWN, error, 3);
    kmp_json_put(json, "below %i h %.3g hdot %.3g drift %.3g", kmp_compared_is_below(c, run, KMP_QUANTITY_Q),
                 run->verdict.h_max, run->verdict.hdot_max, run->verdict.drift_rel);
    kmp_print_counts(json, &run->report);
    kmp_json_put(json, "cpu %.4g ready %.4g memory %.4g }", run->cpu_s, c->system->build_s + run->build_s,
                 run->report.heap > 0 ? (double)run->report.heap : NAN);
}

static void put_level(kmp_json *json, const kempe_comparison *c, int l)
{
    kmp_json_put(json, "{ level %.3g blank %i best %ld run [", c->levels.level[l], c->levels.blank[l],
                 c->levels.best[l] < 0 ? -1 : c->runs[c->levels.best[l]].method - c->methods);
    for (int w = 0; w < c->method_count; w++)
        kmp_json_whole(json, NULL, c->levels.run[w * c->levels.count + l]);
    kmp_json_end(json);
    /* Seconds, steps and evaluations of each method at a level. */
    kmp_json_array(json, "cost");
    for (int w = 0; w < c->method_count; w++) {
        kmp_method_cost cost = kmp_compare_cost(c, w, l);
        kmp_json_rounded_numbers(json, NULL, 3, (const double[]){cost.cpu_s, cost.steps, cost.rhs}, 4);
    }
    kmp_json_put(json, "] }");
}

/* The two tables: methods by their place in the list, with the place of the method that each is compared with. */
static void put_table(kmp_json *json, const kempe_comparison *c, const char *key, int count, const int *methods,
                      bool same)
{
    kmp_json_array(json, key);
    for (int k = 0; k < count; k++) {
        kmp_json_put(json, "{ method %d base [", methods[k]);
        for (int a = 0; a < c->tables.aims.count; a++) {
            int level = c->tables.aims.level[a];
            kmp_json_whole(json, NULL, same ? kmp_compare_base(c, methods[k], level) : kmp_compare_best(c, level));
        }
        kmp_json_put(json, "] }");
    }
    kmp_json_end(json);
}

/* -- runs in detail ---------------------------------------------------------------------------------- */

void kmp_page_record(kmp_json *json, const kmp_record *record)
{
    int rows = record->row.rows;
    kmp_json_put(json, "{ run %d rows %d t_start %.7g spacing %.9g t_end %.7g", record->run, rows,
                 rows > 0 ? kmp_samples_time(&record->row, 0) : 0,
                 rows > 1 ? kmp_samples_time(&record->row, 1) - kmp_samples_time(&record->row, 0) : 0,
                 rows > 0 ? kmp_samples_time(&record->row, rows - 1) : 0);
    kmp_json_rounded_numbers(json, "h", rows, record->h, 3);
    kmp_json_rounded_numbers(json, "hdot", rows, record->hdot, 3);
    kmp_json_rounded_numbers(json, "energy", rows, record->energy, 3);
    static const char *const name[3] = {"t", "least", "most"};
    kmp_json_put(json, "each %ld step { count %d", record->each, record->range_count);
    for (int part = 0; part < 3; part++) {
        kmp_json_array(json, name[part]);
        for (int k = 0; k < record->range_count; k++) {
            const kmp_step_range *range = &record->ranges[k];
            kmp_json_rounded(json, NULL,
                             part == 0   ? range->t
                             : part == 1 ? range->least
                                         : range->most,
                             part == 0 ? 6 : 3);
        }
        kmp_json_end(json);
    }
    kmp_json_end(json);
    const kmp_run_log *log = &record->log;
    enum { MOST = 300 };
    kmp_json_put(json, "log_count %ld log [", log->count);
    for (int k = 0; k < log->kept && k < MOST; k++) {
        const kmp_log_entry *entry = &log->entries[k];
        kmp_json_put(json, "{ t %.7g kind %s text %s }", entry->t, or_empty(entry->kind), or_empty(entry->text));
    }
    kmp_json_put(json, "] }");
}

/* Puts all data of the page, as one JSON object. `picture`: the record whose rows are the frames, NULL: none. */
static void page_data(kmp_text *text, const kempe_comparison *c, int count, const kmp_record *records,
                      const kmp_record *picture)
{
    kmp_json json = kmp_json_begin_compact(text);
    kmp_json_put(&json, "{ kempe %s model %s status %s reason %s t_end %.7g n %d m %d", KEMPE_VERSION,
                 c->system->model->name, kempe_outcome_text(kmp_outcome_of(c->status)), or_empty(c->reason), c->t_end,
                 c->system->n, c->system->m);
    double uncertainty[KMP_COMPARE_SHOWN];
    for (int k = 0; k < KMP_COMPARE_SHOWN; k++)
        uncertainty[k] = c->has_reference ? c->uncertainty[kmp_compare_shown[k]] : NAN;
    kmp_json_put(&json, "reference { there %i source %s", c->has_reference, or_empty(c->source));
    kmp_json_rounded_numbers(&json, "uncertainty", KMP_COMPARE_SHOWN, uncertainty, 3);
    kmp_json_put(&json, "} methods [");
    for (int k = 0; k < c->method_count; k++) {
        const kmp_method *method = &c->methods[k];
        kmp_text name = {0};
        kmp_compare_name(&name, method);
        kmp_json_put(&json, "{ name %s formulation %s form %s integrator %s }", or_empty(name.s), method->formulation,
                     or_empty(method->form), method->integrator);
        kmp_text_free_part(json.text, &name);
    }
    kmp_json_put(&json, "] runs [");
    for (int k = 0; k < c->count; k++)
        put_run(&json, c, &c->runs[k]);
    kmp_json_put(&json, "] levels [");
    for (int l = 0; l < c->levels.count; l++)
        put_level(&json, c, l);
    kmp_json_end(&json);
    const kmp_tables *t = &c->tables;
    kmp_json_array(&json, "aims");
    for (int k = 0; k < t->aims.count; k++)
        kmp_json_whole(&json, NULL, t->aims.level[k]);
    kmp_json_end(&json);
    put_table(&json, c, "same", t->same_count, t->same, true);
    put_table(&json, c, "bests", t->best_count, t->best, false);
    kmp_json_put(&json, "advice { run %d level %.3g stiff %i", c->advice.run, c->advice.level, c->advice.stiff);
    kmp_sentences_json(&json, "reasons", &c->advice.because);
    kmp_json_end(&json);
    kmp_sentences_json(&json, "failures", &c->failures);
    kmp_sentences_json(&json, "warnings", &c->warnings);
    kmp_json_array(&json, "shown");
    for (int k = 0; k < count; k++)
        kmp_page_record(&json, &records[k]);
    kmp_json_end(&json);
    kmp_motion_picture(&json, "picture", c->system->model, picture ? &picture->row : NULL, NULL);
    kmp_json_end(&json);
}

/* -- running again ----------------------------------------------------------------------------------- */

/* All that is made for a page before it is written. */
typedef struct detail {
    int count, *run;
    kmp_record *records, picture;
} detail;

/* A run that ended well ends well again; one that is interrupted is shown as far as it came. */
static kempe_status record_runs(const kempe_comparison *c, detail *d)
{
    kempe_context *context = c->system->context;
    int wanted = kmp_page_choose(c, d->run);
    for (int k = 0; k < wanted && !kmp_interrupted(context); k++) {
        const kmp_method *method = c->runs[d->run[k]].method;
        kmp_log(context, KEMPE_LOG_PROGRESS, "report: %s %s, rtol %g repeated", method->formulation, method->integrator,
                c->runs[d->run[k]].rtol);
        kempe_status status = kmp_record_make(c, d->run[k], c->t_end, &d->records[d->count]);
        d->count += status == KEMPE_OK || status == KEMPE_STOPPED;
        if (!kmp_has_result(status))
            return status;
    }
    return KEMPE_OK;
}

/* A long run is shown from its beginning, as long as the eye can follow. */
static kempe_status record_picture(const kempe_comparison *c, detail *d, const kmp_record **picture)
{
    *picture = &d->picture;
    if (d->count == 0)
        return kmp_record_start(c->system, &d->picture);
    *picture = &d->records[0];
    const kmp_samples *row = &d->records[0].row;
    double t_end = kmp_motion_picture_end(c->system->model, *picture);
    if (row->rows == 0 || !(t_end < kmp_samples_time(row, row->rows - 1)) || kmp_interrupted(c->system->context))
        return KEMPE_OK;
    kempe_status status = kmp_record_make(c, d->records[0].run, t_end, &d->picture);
    if (status == KEMPE_OK || status == KEMPE_STOPPED)
        *picture = &d->picture;
    return kmp_has_result(status) ? KEMPE_OK : status;
}

static kempe_status make_page(const kempe_comparison *c, detail *d, const char *path)
{
    static const char *const *const scripts[] = {
        kmp_phrases_js,    kmp_plots_js, kmp_records_js, kmp_comparison_plots_js, KMP_PICTURE_SCRIPTS,
        kmp_comparison_js, NULL};
    const kmp_record *picture = NULL;
    kmp_text data = {0};
    KMP_TRY(record_runs(c, d));
    KMP_TRY(record_picture(c, d, &picture));
    kmp_context_clear(c->system->context); /* errors of a start that cannot be assembled */
    page_data(&data, c, d->count, d->records, picture);
    return kmp_sheet_write(c->system->context,
                           &(kmp_sheet){.body = kmp_comparison_html,
                                        .model = c->system->model->name,
                                        .subject = "comparison",
                                        .scripts = scripts,
                                        .data = &data},
                           path);
}

kempe_status kempe_comparison_write_report(const kempe_comparison *comparison, const char *path)
{
    KMP_WANTED(NULL, comparison, "comparison");
    KMP_WANTED(comparison->system->context, path, "path");
    kempe_context *context = comparison->system->context;
    kmp_model_begin(comparison->system->model);
    KMP_TRY(kempe_report_check(context));
    detail d = {.run = KMP_NEW(int, comparison->method_count + 1),
                .records = KMP_NEW(kmp_record, comparison->method_count + 1)};
    kempe_status status = d.run && d.records ? make_page(comparison, &d, path) : kmp_fail_memory(context);
    for (int k = 0; k < d.count; k++)
        kmp_record_free(&d.records[k]);
    kmp_record_free(&d.picture);
    kmp_free(d.records);
    kmp_free(d.run);
    return status;
}
