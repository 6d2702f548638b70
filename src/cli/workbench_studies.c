/* SPDX-License-Identifier: BSD-3-Clause */
/* `kempe workbench`: serves the page of a model file to a browser on this machine until Ctrl-C. */
#include "platform/platform.h"
#include "study.h"
#include "terminal.h"

#include <kempe/workbench.h>

/* A browser that was not running may keep its command until it is closed. */
static void *open_browser(void *address)
{
    if (!cli_open_page(address))
        (void)cli_complain("'%s' could not open the address: open it in a browser", cli_browser());
    return NULL;
}

kempe_status cli_workbench(const cli_job *j)
{
    const cli_settings *s = j->settings;
    char command[KMP_PATH_MOST];
    kempe_workbench *workbench = NULL;
    pthread_t thread;
    if (!kmp_path_of_command(command)) {
        (void)cli_complain("the path of this command is not known, which runs the studies of the page");
        return KEMPE_E_FAILED;
    }
    kempe_status status = kempe_workbench_new(j->context, s->file, s->readable, command, s->port, &workbench);
    cli_report_failure(j, status, false);
    if (status != KEMPE_OK)
        return status;
    const char *address = kempe_workbench_address(workbench);
    printf("%s\n", address);
    (void)fflush(stdout);
    if (!s->no_browser && !kmp_thread_start_deaf(&thread, open_browser, (void *)(uintptr_t)address))
        (void)cli_complain("no browser could be opened: open the address in one");
    kempe_workbench_wait(workbench);
    kempe_workbench_free(workbench);
    return KEMPE_OK;
}
