/* SPDX-License-Identifier: BSD-3-Clause */
/* A page with its libraries and scripts, in one file: lines of report.html that consist of a mark are replaced by what
 * the mark means. */
#include "report/page.h"
#include "base/file.h"
#include "model/data/flexible.h"
#include "model/read/loads.h"
#include "output/plot.h"
#include "picture/motion_picture.h"
#include <string.h>

/* -- the file ---------------------------------------------------------------------------------------- */

/* Scripts of all pages, in order. */
static const char *const *const common[] = {kmp_phrases_js,     kmp_plots_js,       kmp_solids_js,
                                            kmp_shapes_js,      kmp_scene_webgl_js, kmp_scene_canvas_js,
                                            kmp_stage_views_js, kmp_animation_js,   NULL};

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

/* A library of others (third_party), whose last line need not end. */
static void put_library(kmp_text *text, const char *const *pieces)
{
    put_all(text, pieces);
    kmp_text_put(text, "\n");
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
static void put_line(kmp_text *text, const kmp_result_page *page, const kmp_page_kind *kind, const char *line)
{
    if (is_mark(line, "<!--TITLE-->")) {
        kmp_text_put(text, "<title>");
        kmp_text_escape(text, kempe_model_name(page->system->model));
        kmp_text_printf(text, ": %s</title>\n", kind->title);
    } else if (is_mark(line, "<!--STYLE-->")) {
        put_all(text, kmp_shared_look_css);
        put_all(text, kmp_report_css);
    } else if (is_mark(line, "<!--STAGE-->")) {
        put_all(text, kmp_stage_html);
    } else if (is_mark(line, "<!--RECORDS-->")) {
        put_all(text, kmp_records_html);
    } else if (is_mark(line, "/*THREE*/")) {
        put_library(text, kmp_three_min_js);
    } else if (is_mark(line, "/*CHART*/")) {
        put_library(text, kmp_chart_min_js);
    } else if (is_mark(line, "/*SCRIPT*/")) {
        const bool flexible = kmp_model_flexible_count(page->system->model) > 0;
        put_scripts(text, common, flexible);
        if (flexible)
            put_all(text, kmp_scene_flexible_js);
        put_scripts(text, kind->view->scripts, flexible);
    } else if (is_mark(line, "/*DATA*/")) {
        kmp_text_printf(text, "%s\n", page->data.text->s ? page->data.text->s : "");
    } else {
        kmp_text_put(text, line);
    }
}

static void put_page(kmp_text *text, const kmp_result_page *page, const kmp_page_kind *kind)
{
    for (const char *const *line = kmp_report_html; *line; line++)
        if (is_mark(*line, "<!--SECTIONS-->"))
            for (const char *const *own = kind->view->sections; *own; own++)
                put_line(text, page, kind, *own);
        else
            put_line(text, page, kind, *line);
}

/* -- the page ---------------------------------------------------------------------------------------- */

kempe_status kmp_page_take(kmp_result_page *page, const kempe_system *system)
{
    page->system = system;
    kmp_samples_init(&page->picture.states, system->n, system->m);
    kmp_model_begin(system->model);
    page->picture.zero = KMP_ARENA_NEW(&page->arena, double, system->n + system->m);
    return kmp_made(page->context, page->picture.zero);
}

void kmp_page_set_outcome(kmp_result_page *page, kempe_outcome outcome, const char *reason, const char *warnings,
                          const char *words)
{
    int n = page->system->n, m = page->system->m;
    page->head.outcome = outcome;
    page->head.reason = reason;
    page->head.warnings = warnings;
    page->head.scene = kmp_arena_printf(&page->arena, "%s \xc2\xb7 %d coordinate%s, %d constraint equation%s", words, n,
                                        n == 1 ? "" : "s", m, m == 1 ? "" : "s");
}

kempe_status kmp_page_add_frames(kmp_result_page *page, int count, const double *q, ptrdiff_t stride, const double *x)
{
    kmp_samples *states = &page->picture.states;
    const double *zero = page->picture.zero;
    page->picture.frames = states;
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
                 kempe_model_name(s->model), kind->command, page->head.scene, kempe_outcome_text(page->head.outcome),
                 page->head.reason ? page->head.reason : "", s->n, s->m);
    for (int k = 0; k < page->motion.record_count; k++)
        if (page->motion.records[k].row.rows > 0)
            kmp_record_put(json, &page->motion.records[k]);
    kmp_json_end(json);
    const kmp_shown length = kmp_shown_as(page->context, "m");
    kmp_json_put(json, "length { unit %s factor %.17g }", length.unit, length.factor);
    kmp_motion_picture(json, "picture", s->model, page->picture.frames, page->picture.x, &page->picture.arrows);
    kmp_json_end(json);
}

static kempe_status make_page(kmp_result_page *page, const kmp_page_kind *kind, const kempe_system *system,
                              const void *result, const char *path)
{
    if (system)
        KMP_TRY(kmp_page_take(page, system));
    kmp_json_object(&page->data, NULL);
    KMP_TRY(kind->fill(page, result));
    KMP_TRY(kmp_made(page->context, !page->arena.failed));
    if (kind->view->put)
        kind->view->put(page);
    put_rest(page, kind);
    kmp_text text = {.failed = page->data.text->failed};
    put_page(&text, page, kind);
    return kmp_file_write(page->context, path, &text);
}

kempe_status kmp_page_write(const kmp_page_kind *kind, kempe_context *context, const kempe_system *system,
                            const void *result, const char *path)
{
    KMP_WANTED(context, path, "path");
    kmp_text data = {0};
    kmp_result_page page = {.context = context, .data = kmp_json_begin_as(&data, KMP_JSON_COMPACT)};
    kempe_status status = make_page(&page, kind, system, result, path);
    for (int k = 0; k < page.motion.record_count; k++)
        kmp_record_free(&page.motion.records[k]);
    kmp_record_free(&page.picture.start);
    kmp_samples_free(&page.picture.states);
    kempe_table_free(page.curves.table);
    kempe_statistics_free(page.statistics);
    kempe_table_free(page.loads.reactions);
    kempe_table_free(page.loads.bearings);
    kmp_picture_forces_free(&page.picture.arrows);
    kempe_comfort_free(page.motion.comfort);
    kempe_text_free(page.head.text);
    kempe_system_free(page.own);
    kmp_arena_free(&page.arena);
    kmp_text_free(&data);
    return status == KEMPE_OK ? page.verdict : status;
}
