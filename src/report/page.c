/* SPDX-License-Identifier: BSD-3-Clause */
/* The report of a comparison: runs made once more, and the page with them. */
#include "report/page.h"
#include "base/memory.h"
#include "model/data/model.h"
#include "model/read/loads.h"
#include "report/data.h"
#include "report/motion_picture.h"
#include "report/sheet.h"

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
    kmp_page_data(&data, c, d->count, d->records, picture);
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
