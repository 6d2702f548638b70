/* SPDX-License-Identifier: BSD-3-Clause */
/* A single page without external files. */
#include "base/file.h"
#include "report/page.h"
#include <string.h>
#include <strings.h>

static void put_lines(kmp_text *text, const char *const *lines)
{
    for (; *lines; lines++)
        kmp_text_put(text, *lines);
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

static bool is_mark(const char *line, const char *mark)
{
    size_t length = strlen(mark);
    return strncmp(line, mark, length) == 0 && strcmp(line + length, "\n") == 0;
}

static bool put_part(kmp_text *text, const kmp_sheet *sheet, const char *line)
{
    if (is_mark(line, "<!--TITLE-->")) {
        kmp_text_put(text, "<title>");
        kmp_text_escape(text, sheet->model);
        kmp_text_printf(text, ": %s</title>\n", sheet->subject);
    } else if (is_mark(line, "<!--NOTICE-->")) {
        put_lines(text, kmp_notice_html);
    } else if (is_mark(line, "<!--STYLE-->")) {
        put_lines(text, kmp_comparison_css);
    } else if (is_mark(line, "/*SCRIPT*/")) {
        for (const char *const *const *script = sheet->scripts; *script; script++)
            put_lines(text, *script);
    } else if (is_mark(line, "/*THREE*/")) {
        put_script(text, sheet->libraries->three);
    } else if (is_mark(line, "/*CHART*/")) {
        put_script(text, sheet->libraries->chart);
    } else if (is_mark(line, "/*DATA*/")) {
        kmp_text_put(text, sheet->data);
        kmp_text_put(text, "\n");
    } else {
        return false;
    }
    return true;
}

kempe_status kmp_sheet_write(kempe_context *context, const kmp_sheet *sheet, const char *path)
{
    kmp_text text = {0};
    for (const char *const *line = sheet->html; *line; line++)
        if (!put_part(&text, sheet, *line))
            kmp_text_put(&text, *line);
    return kmp_file_write(context, path, &text);
}
