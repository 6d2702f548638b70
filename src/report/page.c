/* SPDX-License-Identifier: BSD-3-Clause */
/* A page with its libraries and scripts; the report of a comparison: runs made once more, and the page with them. */
#include "report/page.h"
#include "base/file.h"
#include "base/memory.h"
#include "model/data/model.h"
#include "model/read/loads.h"
#include "report/data.h"
#include "report/motion_picture.h"
#include <stdlib.h>
#include <string.h>
#include <strings.h>

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

/* -- libraries --------------------------------------------------------------------------------------- */

static const struct library {
    const char *mark, *name, *package;
    const char *files[2]; /* below a folder */
} libraries[] = {{"/*THREE*/", "three.js", "libjs-three", {"three/three.min.js", "three.min.js"}},
                 {"/*CHART*/", "Chart.js", "libjs-chart.js", {"chart.js/chart.min.js", "chart.min.js"}}};

enum { LIBRARIES = sizeof libraries / sizeof *libraries };

/* The variable names a folder to look in instead. */
static const char variable[] = "KEMPE_JAVASCRIPT", usual[] = "/usr/share/javascript";

/* Takes the first file that can be read; errors of the others are discarded. */
static kempe_status read_library(kempe_context *context, const struct library *l, char **text)
{
    const char *own = getenv(variable), *folder = own && *own ? own : usual;
    size_t length;
    for (int k = 0; k < 2; k++) {
        kmp_text path = {0};
        kmp_text_printf(&path, "%s/%s", folder, l->files[k]);
        kempe_status status =
            path.failed ? KEMPE_E_MEMORY : kmp_file_read(context, KMP_FILE_SCRIPT, path.s, text, &length);
        kmp_text_free(&path);
        kmp_context_clear(context);
        if (status != KEMPE_E_IO)
            return status == KEMPE_OK ? KEMPE_OK : kmp_fail_memory(context);
    }
    return kmp_fail(context, KEMPE_E_IO,
                    "a report needs %s, but '%s' is missing in %s: install the Debian package %s, or give its folder "
                    "in the environment variable %s",
                    l->name, l->files[0], folder, l->package, variable);
}

kempe_status kempe_report_check(kempe_context *context)
{
    KMP_WANTED(NULL, context, "context");
    kmp_context_clear(context);
    for (int k = 0; k < LIBRARIES; k++) {
        char *text = NULL;
        KMP_TRY(read_library(context, &libraries[k], &text));
        kmp_free(text);
    }
    return KEMPE_OK;
}

/* The text of an external script. A sequence that would end it, or open a comment of the page, gets a backslash. It can
 * occur within strings and regular expressions alone, where this changes nothing. */
static void put_script(kmp_text *text, const char *script)
{
    while (*script) {
        size_t length = strcspn(script, "<");
        kmp_text_printf(text, "%.*s", (int)length, script);
        script += length;
        if (!*script)
            break;
        bool ends = strncasecmp(script, "</script", 8) == 0, opens = strncmp(script, "<!--", 4) == 0;
        kmp_text_put(text, ends || opens ? "<\\" : "<");
        script++;
    }
    kmp_text_put(text, "\n");
}

/* -- the page ---------------------------------------------------------------------------------------- */

static void put_lines(kmp_text *text, const char *const *lines)
{
    for (; *lines; lines++)
        kmp_text_put(text, *lines);
}

static bool is_mark(const char *line, const char *mark)
{
    size_t length = strlen(mark);
    return strncmp(line, mark, length) == 0 && strcmp(line + length, "\n") == 0;
}

static void put_part(kmp_text *text, const kmp_sheet *sheet, const char *line)
{
    if (is_mark(line, "<!--TITLE-->")) {
        kmp_text_put(text, "<title>");
        kmp_text_escape(text, sheet->model);
        kmp_text_printf(text, ": %s</title>\n", sheet->subject);
    } else if (is_mark(line, "<!--STYLE-->")) {
        put_lines(text, kmp_report_css);
    } else if (is_mark(line, "<!--BODY-->")) {
        put_lines(text, sheet->body);
    } else if (is_mark(line, "/*SCRIPT*/")) {
        for (const char *const *const *script = sheet->scripts; *script; script++)
            put_lines(text, *script);
    } else if (is_mark(line, "/*DATA*/")) {
        kmp_text_put(text, sheet->data->s ? sheet->data->s : "");
        kmp_text_put(text, "\n");
    } else {
        kmp_text_put(text, line);
    }
}

/* Puts the library whose mark the line is. */
static kempe_status put_library(kempe_context *context, kmp_text *text, const char *line, bool *put)
{
    *put = false;
    for (int k = 0; k < LIBRARIES && !*put; k++)
        if (is_mark(line, libraries[k].mark)) {
            char *script = NULL;
            KMP_TRY(read_library(context, &libraries[k], &script));
            KMP_TRY(kmp_made(context, script));
            put_script(text, script);
            kmp_free(script);
            *put = true;
        }
    return KEMPE_OK;
}

kempe_status kmp_sheet_write(kempe_context *context, const kmp_sheet *sheet, const char *path)
{
    kmp_text text = {.failed = sheet->data->failed};
    kempe_status status = KEMPE_OK;
    for (const char *const *line = kmp_report_html; *line && status == KEMPE_OK; line++) {
        bool put;
        status = put_library(context, &text, *line, &put);
        if (!put)
            put_part(&text, sheet, *line);
    }
    kmp_text_free(sheet->data);
    if (status == KEMPE_OK)
        return kmp_file_write(context, path, &text);
    kmp_text_free(&text);
    return status;
}
