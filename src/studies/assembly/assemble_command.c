/* SPDX-License-Identifier: BSD-3-Clause */
#include "cli/command.h"
#include <kempe/branches.h>
#include <kempe/check.h>

static kempe_status print_assembly(const void *object, kempe_format format, char **text)
{
    return kempe_assembly_print(object, format, text);
}

static kempe_status print_branches(const void *object, kempe_format format, char **text)
{
    return kempe_branches_print(object, format, text);
}

static kempe_status assemble(const cli_job *j)
{
    kempe_assembly *result = NULL;
    kempe_status status = kempe_assembly_new(j->system, &result);
    cli_tell_failure(j, status, result != NULL);
    if (result)
        status = cli_worse(status, cli_report(j, print_assembly, result));
    kempe_assembly_free(result);
    return status;
}

static kempe_status branches(const cli_job *j)
{
    kempe_branches *result = NULL;
    double seed = j->settings->seed;
    kempe_status status = kempe_branches_new(j->system, seed > 0 && seed < 1e9 ? (int)seed : 1, &result);
    cli_tell_failure(j, status, result != NULL);
    if (result)
        status = cli_worse(status, cli_report(j, print_branches, result));
    kempe_branches_free(result);
    return status;
}

static kempe_status assemble_or_branches(const cli_job *j)
{
    return j->settings->branches ? branches(j) : assemble(j);
}

const cli_command cli_assemble = {
    .bit = CLI_ASSEMBLE,
    .name = "assemble",
    .usage = "FILE [options]",
    .summary = "assembly: close the loops, starting from the model's start values; assembly modes",
    .examples = "  kempe assemble examples/four_bar/four_bar.yaml --json start.json\n"
                "  kempe assemble examples/four_bar/four_bar.yaml --branches\n",
    .run = assemble_or_branches,
};
