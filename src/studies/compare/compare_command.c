/* SPDX-License-Identifier: BSD-3-Clause */
#include "cli/command.h"
#include <kempe/compare.h>

static kempe_status print_comparison(const void *object, kempe_format format, char **text)
{
    return kempe_comparison_print(object, format, text);
}

static kempe_status compare(const cli_job *j)
{
    kempe_comparison *result = NULL;
    kempe_status status = j->settings->report ? kempe_report_check(j->context) : KEMPE_OK;
    if (status == KEMPE_OK)
        status = kempe_comparison_new(j->system, &j->settings->compare, &result);
    cli_tell_failure(j, status, result != NULL);
    if (result) {
        status = cli_worse(status, cli_report(j, print_comparison, result));
        if (j->settings->csv)
            status = cli_worse(status, cli_tell_written(j, kempe_comparison_write_csv(result, j->settings->csv)));
        if (j->settings->report)
            status = cli_worse(status, cli_tell_written(j, kempe_comparison_write_report(result, j->settings->report)));
    }
    kempe_comparison_free(result);
    return status;
}

const cli_command cli_compare = {
    .bit = CLI_COMPARE,
    .name = "compare",
    .usage = "FILE [options]",
    .summary = "compare formulations, integrators and tolerances against a reference solution",
    .examples =
        "  kempe compare examples/andrews/andrews.yaml --reference examples/andrews/reference.csv\n"
        "  kempe compare examples/four_bar/four_bar.yaml --rtol 1e-6,1e-9 --formulations reduced,dae --csv table.csv\n"
        "  kempe compare examples/andrews/andrews.yaml --report andrews.html\n",
    .run = compare,
};
