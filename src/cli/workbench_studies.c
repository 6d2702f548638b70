/* SPDX-License-Identifier: BSD-3-Clause */
/* `kempe workbench`: serves the page of a model file to a browser on this machine until Ctrl-C. */
#include "platform/platform.h"
#include "study.h"
#include "terminal.h"

#include <errno.h>
#include <kempe/workbench.h>
#include <stdlib.h>
#include <string.h>

/* A page that leads to the address, in a folder that only this user can read: other users see the words of a browser's
 * process, which must not have the token. */
typedef struct door {
    char folder[KMP_PATH_MOST], page[KMP_PATH_MOST + 16];
} door;

static bool make_door(door *d, const char *address)
{
    char temporary[KMP_PATH_MOST];
    kmp_path_temporary(temporary);
    if (snprintf(d->folder, sizeof d->folder, "%s/kempe-XXXXXX", temporary) >= KMP_PATH_MOST ||
        !kmp_folder_temporary(d->folder)) {
        d->folder[0] = '\0';
        return false;
    }
    (void)snprintf(d->page, sizeof d->page, "%s/workbench.html", d->folder);
    FILE *out = fopen(d->page, "wb");
    if (!out)
        return false;
    fprintf(out,
            "<!DOCTYPE html>\n<meta charset=\"utf-8\">\n<meta name=\"referrer\" content=\"no-referrer\">\n"
            "<meta http-equiv=\"refresh\" content=\"0; url=%s\">\n<a href=\"%s\">Workbench</a>\n",
            address, address);
    return fclose(out) == 0;
}

static void remove_door(door *d)
{
    if (d->folder[0]) {
        (void)kmp_path_remove(d->page);
        (void)kmp_folder_remove(d->folder);
    }
    free(d);
}

/* A browser that was not running may keep its command until it is closed. */
static void *open_browser(void *page)
{
    if (!cli_open_page(page))
        (void)cli_complain("'%s' could not open the page: open its address in a browser", cli_browser());
    return NULL;
}

/* The caller removes it. NULL: the browser is not wanted, or cannot be opened, after a message. */
static door *begin_browser(const cli_settings *s, const char *address)
{
    pthread_t thread;
    door *d = s->no_browser ? NULL : calloc(1, sizeof *d);
    if (d && (!make_door(d, address) || !kmp_thread_start_deaf(&thread, open_browser, d->page)))
        (void)cli_complain("no browser could be opened (%s): open the address in one", strerror(errno));
    return d;
}

kempe_status cli_workbench(const cli_job *j)
{
    const cli_settings *s = j->settings;
    char command[KMP_PATH_MOST];
    kempe_workbench *workbench = NULL;
    if (!kmp_path_of_command(command)) {
        (void)cli_complain("the path of this command is not known, which runs the studies of the page");
        return KEMPE_E_FAILED;
    }
    kempe_status status = kempe_workbench_new(j->context, s->file, s->readable, command, s->port, &workbench);
    cli_report_failure(j, status, false);
    if (status != KEMPE_OK)
        return status;
    printf("%s\n", kempe_workbench_address(workbench));
    (void)fflush(stdout);
    door *d = begin_browser(s, kempe_workbench_address(workbench));
    kempe_workbench_wait(workbench);
    kempe_workbench_free(workbench);
    if (d)
        remove_door(d);
    return KEMPE_OK;
}
