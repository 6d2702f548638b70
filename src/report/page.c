/* SPDX-License-Identifier: BSD-3-Clause */
/* A page with its libraries and scripts, in one file: lines of report.html that consist of a mark are replaced by what
 * the mark means. */
#include "report/page.h"
#include "base/file.h"
#include "base/memory.h"
#include "model/data/model.h"
#include "model/read/loads.h"
#include "output/plot.h"
#include "output/print.h"
#include "platform/platform.h"
#include "report/motion_picture.h"
#include <stdlib.h>
#include <string.h>
#include <strings.h>

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
    const char *own = kmp_environment(variable), *folder = own && *own ? own : usual;
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
 * occur only within strings and regular expressions, where this changes nothing. */
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

/* -- the file ---------------------------------------------------------------------------------------- */

/* Scripts of all pages, in order. */
static const char *const *const common[] = {kmp_phrases_js,     kmp_plots_js,        kmp_solids_js,    kmp_shapes_js,
                                            kmp_scene_webgl_js, kmp_scene_canvas_js, kmp_animation_js, NULL};

static bool is_mark(const char *line, const char *mark)
{
    size_t length = strlen(mark);
    return strncmp(line, mark, length) == 0 && strcmp(line + length, "\n") == 0;
}

static void put_all(kmp_text *text, const char *const *lines)
{
    for (; *lines; lines++)
        kmp_text_put(text, *lines);
}

/* Lines of scripts that begin with this mark are only for pages with flexible bodies. */
static const char of_flexible[] = "/*FLEXIBLE*/ ";

static void put_scripts(kmp_text *text, const char *const *const *scripts, bool flexible)
{
    for (; *scripts; scripts++)
        for (const char *const *line = *scripts; *line; line++) {
            const size_t indent = strspn(*line, " "), mark = sizeof of_flexible - 1;
            const bool marked = strncmp(*line + indent, of_flexible, mark) == 0;
            if (is_mark(*line, "/*COLOURS*/"))
                kmp_plot_put_colours(text);
            else if (!marked)
                kmp_text_put(text, *line);
            else if (flexible)
                kmp_text_printf(text, "%.*s%s", (int)indent, *line, *line + indent + mark);
        }
}

/* A line, or what it is the mark of. */
static kempe_status put_line(kmp_text *text, const kmp_result_page *page, const kmp_page_kind *kind, const char *line)
{
    for (int k = 0; k < LIBRARIES; k++)
        if (is_mark(line, libraries[k].mark)) {
            char *script = NULL;
            KMP_TRY(read_library(page->context, &libraries[k], &script));
            KMP_TRY(kmp_made(page->context, script));
            put_script(text, script);
            kmp_free(script);
            return KEMPE_OK;
        }
    if (is_mark(line, "<!--TITLE-->")) {
        kmp_text_put(text, "<title>");
        kmp_text_escape(text, page->system->model->name);
        kmp_text_printf(text, ": %s</title>\n", kind->title);
    } else if (is_mark(line, "<!--STYLE-->")) {
        put_all(text, kmp_report_css);
    } else if (is_mark(line, "<!--STAGE-->")) {
        put_all(text, kmp_stage_html);
    } else if (is_mark(line, "<!--RECORDS-->")) {
        put_all(text, kmp_records_html);
    } else if (is_mark(line, "/*SCRIPT*/")) {
        const bool flexible = page->system->model->flexible_count > 0;
        put_scripts(text, common, flexible);
        if (flexible)
            put_all(text, kmp_scene_flexible_js);
        put_scripts(text, kind->view->scripts, flexible);
    } else if (is_mark(line, "/*DATA*/")) {
        kmp_text_printf(text, "%s\n", page->data.text->s ? page->data.text->s : "");
    } else {
        kmp_text_put(text, line);
    }
    return KEMPE_OK;
}

static kempe_status put_page(kmp_text *text, const kmp_result_page *page, const kmp_page_kind *kind)
{
    for (const char *const *line = kmp_report_html; *line; line++)
        if (is_mark(*line, "<!--SECTIONS-->"))
            for (const char *const *own = kind->view->sections; *own; own++)
                KMP_TRY(put_line(text, page, kind, *own));
        else
            KMP_TRY(put_line(text, page, kind, *line));
    return KEMPE_OK;
}

/* -- the page ---------------------------------------------------------------------------------------- */

kempe_status kmp_page_take(kmp_result_page *page, const kempe_system *system)
{
    page->system = system;
    kmp_samples_init(&page->states, system->n, system->m);
    kmp_model_begin(system->model);
    page->zero = KMP_ARENA_NEW(&page->arena, double, system->n + system->m);
    return kmp_made(page->context, page->zero);
}

void kmp_page_set_outcome(kmp_result_page *page, kempe_outcome outcome, const char *reason, const char *warnings,
                          const char *words)
{
    int n = page->system->n, m = page->system->m;
    page->outcome = outcome;
    page->reason = reason;
    page->warnings = warnings;
    page->scene = kmp_arena_printf(&page->arena, "%s \xc2\xb7 %d coordinate%s, %d constraint equation%s", words, n,
                                   n == 1 ? "" : "s", m, m == 1 ? "" : "s");
}

kempe_status kmp_page_add_frames(kmp_result_page *page, int count, const double *q, ptrdiff_t stride, const double *x)
{
    kmp_samples *states = &page->states;
    const double *zero = page->zero;
    page->frames = states;
    for (int k = 0; k < count; k++)
        if (kmp_samples_add(states, x ? x[k] : states->rows, q + k * stride, zero, zero, zero, 0))
            return kmp_fail_memory(page->context);
    return KEMPE_OK;
}

/* Ends the data: what all pages have. */
static void put_rest(kmp_result_page *page, const kmp_page_kind *kind)
{
    kmp_json *json = &page->data;
    const kempe_system *s = page->system;
    kmp_json_put(json, "kempe %s model %s command %s scene %s status %s reason %s n %d m %d shown [", KEMPE_VERSION,
                 s->model->name, kind->command, page->scene, kempe_outcome_text(page->outcome),
                 page->reason ? page->reason : "", s->n, s->m);
    for (int k = 0; k < page->record_count; k++)
        if (page->records[k].row.rows > 0)
            kmp_record_put(json, &page->records[k]);
    kmp_json_end(json);
    kmp_motion_picture(json, "picture", s->model, page->frames, page->frame_x, &page->arrows);
    kmp_json_end(json);
}

static kempe_status make_page(kmp_result_page *page, const kmp_page_kind *kind, const kempe_system *system,
                              const void *result, const char *path)
{
    KMP_TRY(kempe_report_check(page->context));
    if (system)
        KMP_TRY(kmp_page_take(page, system));
    kmp_json_object(&page->data, NULL);
    KMP_TRY(kind->fill(page, result));
    KMP_TRY(kmp_made(page->context, !page->arena.failed));
    if (kind->view->put)
        kind->view->put(page);
    put_rest(page, kind);
    kmp_text text = {.failed = page->data.text->failed};
    kempe_status status = put_page(&text, page, kind);
    if (status == KEMPE_OK)
        return kmp_file_write(page->context, path, &text);
    kmp_text_free(&text);
    return status;
}

kempe_status kmp_page_write(const kmp_page_kind *kind, kempe_context *context, const kempe_system *system,
                            const void *result, const char *path)
{
    KMP_WANTED(context, path, "path");
    kmp_text data = {0};
    kmp_result_page page = {.context = context, .data = kmp_json_begin_as(&data, KMP_JSON_COMPACT)};
    kempe_status status = make_page(&page, kind, system, result, path);
    for (int k = 0; k < page.record_count; k++)
        kmp_record_free(&page.records[k]);
    kmp_record_free(&page.start);
    kmp_samples_free(&page.states);
    kempe_table_free(page.table);
    kempe_statistics_free(page.statistics);
    kempe_table_free(page.reactions);
    kempe_table_free(page.bearings);
    kmp_joint_arrows_free(&page.arrows);
    kempe_comfort_free(page.comfort);
    kempe_text_free(page.text);
    kempe_system_free(page.own);
    kmp_arena_free(&page.arena);
    kmp_text_free(&data);
    return status == KEMPE_OK ? page.verdict : status;
}
