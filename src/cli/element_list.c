/* SPDX-License-Identifier: BSD-3-Clause */
/* The library of machine elements: a list, and the text of each. Its lines `name:` and `ports:` are each one line. */
#include "element_list.h"
#include "platform/platform.h"

#include <stdlib.h>
#include <string.h>

bool cli_is_element(const char *file)
{
    return file && strncmp(file, "kempe:", 6) == 0;
}

/* The rest of the line of a text that begins with `key`; "" without one. */
static void put_line(FILE *out, const char *text, const char *key, bool quoted)
{
    const char *at = strstr(text, key);
    const size_t length = at ? strcspn(at + strlen(key), "\n") : 0;
    char *line = at ? calloc(length + 1, 1) : NULL;
    if (line)
        memcpy(line, at + strlen(key), length);
    if (quoted)
        cli_put_quoted(out, line ? line : "");
    else
        fputs(line ? line : "", out);
    free(line);
}

static void put_row(FILE *out, const char *name, const char *text, bool json)
{
    if (json) {
        fputs("{\"file\": ", out);
        cli_put_quoted(out, name);
        fputs(", \"subject\": ", out);
        put_line(out, text, "\nname: ", true);
        fputs(", \"ports\": ", out);
        put_line(out, text, "\nports: ", true);
        putc('}', out);
        return;
    }
    fprintf(out, "%-32s", name);
    put_line(out, text, "\nname: ", false);
    fputs("\n    ", out);
    put_line(out, text, "\nports: ", false);
    putc('\n', out);
}

static kempe_status print_list(const cli_job *j, const void *object, kempe_format format, char **text)
{
    const bool json = format == KEMPE_JSON;
    kempe_status status = KEMPE_OK;
    FILE *out = kmp_text_stream();
    (void)object;
    if (!out)
        return KEMPE_E_MEMORY;
    fputs(json ? "{\"elements\": [" : "", out);
    for (int k = 0; k < kempe_element_count() && status == KEMPE_OK; k++) {
        char *element = NULL;
        status = kempe_element_text(j->context, kempe_element_name(k), &element);
        fputs(json && k > 0 ? ", " : "", out);
        put_row(out, kempe_element_name(k), element ? element : "", json);
        kempe_text_free(element);
    }
    fputs(json ? "]}\n" : "\nnext  kempe show kempe:NAME.yaml prints equations, ports and parameters\n", out);
    *text = kmp_text_stream_end(out);
    if (!*text && status == KEMPE_OK)
        status = KEMPE_E_MEMORY;
    if (status)
        free(*text);
    return status;
}

static kempe_status print_element(const cli_job *j, const void *object, kempe_format format, char **text)
{
    const char *element = object;
    FILE *out = kmp_text_stream();
    if (!out)
        return KEMPE_E_MEMORY;
    if (format == KEMPE_JSON) {
        fputs("{\"file\": ", out);
        cli_put_quoted(out, j->settings->file);
        fputs(", \"text\": ", out);
        cli_put_quoted(out, element);
        fputs("}\n", out);
    } else {
        fputs(element, out);
    }
    *text = kmp_text_stream_end(out);
    return *text ? KEMPE_OK : KEMPE_E_MEMORY;
}

kempe_status cli_show_element(const cli_job *j)
{
    const cli_settings *s = j->settings;
    char *text = NULL;
    if (s->show_as || s->show_equations || s->show_program || s->show_stats) {
        cli_complain("'%s' is a part of models and has no equations of its own: give only 'kempe show %s'", s->file,
                     s->file);
        cli_refuse(s->json);
        return KEMPE_E_ARGUMENT;
    }
    kempe_status status = kempe_element_text(j->context, s->file, &text);
    cli_report_failure(j, status, false);
    if (status == KEMPE_OK)
        status = cli_worse(status, cli_report(j, print_element, text));
    kempe_text_free(text);
    return status;
}

kempe_status cli_list_elements(const cli_job *j)
{
    return cli_worse(KEMPE_OK, cli_report(j, print_list, NULL));
}
