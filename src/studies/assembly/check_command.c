/* SPDX-License-Identifier: BSD-3-Clause */
#include "cli/command.h"
#include <kempe/check.h>

static kempe_status print_check(const void *object, kempe_format format, char **text)
{
    return kempe_check_print(object, format, text);
}

static kempe_status check(const cli_job *j)
{
    kempe_check *result = NULL;
    kempe_status status = kempe_check_new(j->system, &result);
    cli_tell_failure(j, status, result != NULL);
    if (result)
        status = cli_worse(status, cli_report(j, print_check, result));
    kempe_check_free(result);
    return status;
}

const cli_command cli_check = {
    .bit = CLI_CHECK,
    .name = "check",
    .usage = "FILE [options]",
    .summary = "model diagnostics: degrees of freedom, redundant closures, independent coordinates",
    .examples = "  kempe check examples/andrews/andrews.yaml\n",
    .run = check,
};
