/* SPDX-License-Identifier: BSD-3-Clause */
/* The command `kempe view`: opens a page in a browser, one that is there or the page of a model's assembled start. */
#include "command.h"
#include "platform/platform.h"

#include <errno.h>
#include <kempe/check.h>
#include <kempe/compare.h>
#include <stdlib.h>
#include <string.h>

bool cli_is_page(const char *file)
{
    const char *dot = strrchr(file, '.');
    return dot && (strcmp(dot, ".html") == 0 || strcmp(dot, ".htm") == 0);
}

/* -- the browser ----------------------------------------------------------------------------------- */

/* The user's choice, or the choice of the desktop. */
const char *cli_browser(void)
{
    const char *own = kmp_environment("BROWSER");
    return own && *own ? own : kmp_page_opener();
}

bool cli_open_page(const char *path)
{
    const char *own = kmp_environment("BROWSER");
    char *const words[] = {(char *)own, (char *)path, NULL};
    fflush(NULL);
    return own && *own ? kmp_process_run(words, NULL) == 0 : kmp_page_open(path);
}

/* -- the page -------------------------------------------------------------------------------------- */

/* A path of the page that the user has not named, in a separate folder. The caller frees it; NULL: there is none. */
static char *choose_path(const char *model)
{
    char folder[KMP_PATH_MOST];
    kmp_path_temporary(folder);
    size_t size = strlen(folder) + strlen(model) + 32;
    char *path = malloc(size);
    if (!path)
        return NULL;
    snprintf(path, size, "%s/kempe-XXXXXX", folder);
    if (!kmp_folder_temporary(path)) {
        cli_complain("cannot make a folder in '%s': %s", folder, strerror(errno));
        free(path);
        return NULL;
    }
    size_t length = strlen(path);
    snprintf(path + length, size - length, "/%s.html", model);
    for (char *c = path + length + 1; *c; c++)
        *c = (char)(kmp_is_separator(*c) ? '_' : *c);
    return path;
}

/* Loops that cannot be closed are shown, too. */
static kempe_status write_page(const cli_job *j, const char *path)
{
    kempe_assembly *start = NULL;
    kempe_status status = cli_check_report();
    if (status == KEMPE_OK)
        status = kempe_assembly_new(j->system, &start);
    cli_report_failure(j, status, start != NULL);
    if (start) {
#ifdef KEMPE_REPORT
        kempe_status written = cli_report_written(j, kempe_assembly_write_report(start, path));
#else
        kempe_status written = KEMPE_OK;
        (void)path;
#endif
        status = written == KEMPE_OK ? status : cli_worse(KEMPE_OK, written);
    }
    kempe_assembly_free(start);
    return status;
}

static kempe_status print_page(const cli_job *j, const void *object, kempe_format format, char **text)
{
    FILE *out = kmp_text_stream();
    (void)j;
    if (!out)
        return KEMPE_E_MEMORY;
    if (format == KEMPE_JSON)
        cli_put_done(out, object);
    else
        fprintf(out, "%s\n", (const char *)object);
    *text = kmp_text_stream_end(out);
    return *text ? KEMPE_OK : KEMPE_E_MEMORY;
}

static kempe_status show_page(const cli_job *j, const char *path)
{
    kempe_status status = cli_worse(KEMPE_OK, cli_report(j, print_page, path));
    if (status != KEMPE_OK || cli_open_page(path))
        return status;
    cli_complain("'%s' could not open %s: open it in a browser, or name one in the environment variable BROWSER",
                 cli_browser(), path);
    return KEMPE_E_FAILED;
}

kempe_status cli_view(const cli_job *j)
{
    const cli_settings *s = j->settings;
    if (cli_is_page(s->file) && !kmp_path_readable(s->file)) {
        cli_complain("cannot read '%s': %s", s->file, strerror(errno));
        cli_refuse(s->json);
        return KEMPE_E_IO;
    }
    if (cli_is_page(s->file))
        return show_page(j, s->file);
    char *own = s->report ? NULL : choose_path(kempe_model_name(j->model));
    const char *path = s->report ? s->report : own;
    kempe_status status = path ? write_page(j, path) : KEMPE_E_FAILED;
    if (path && (status == KEMPE_OK || (status == KEMPE_E_FAILED && kmp_path_readable(path)))) {
        kempe_status shown = show_page(j, path);
        status = status == KEMPE_OK ? shown : status;
    }
    free(own);
    return status;
}
