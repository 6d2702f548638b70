/* SPDX-License-Identifier: BSD-3-Clause */
/* A page with its libraries and scripts, in one file. */
#include "report/page.h"
#include "base/file.h"
#include "base/memory.h"
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
        for (const char *const *body = sheet->body; *body; body++)
            if (is_mark(*body, "<!--STAGE-->"))
                put_lines(text, kmp_stage_html);
            else
                kmp_text_put(text, *body);
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
