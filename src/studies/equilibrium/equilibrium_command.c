/* SPDX-License-Identifier: BSD-3-Clause */
#include "cli/command.h"
#include <kempe/equilibrium.h>

static kempe_status print_equilibrium(const void *object, kempe_format format, char **text)
{
    return kempe_equilibrium_print(object, format, text);
}

static kempe_status equilibrium(const cli_job *j)
{
    kempe_equilibrium *result = NULL;
    kempe_equilibrium_options ask = j->settings->equilibrium;
    double seed = j->settings->seed;
    ask.global = j->settings->global;
    ask.newton = j->settings->newton;
    ask.seed = seed > 0 && seed < 1e9 ? (int)seed : 1;
    kempe_status status = kempe_equilibrium_new(j->system, &ask, &result);
    cli_tell_failure(j, status, result != NULL);
    if (result)
        status = cli_worse(status, cli_report(j, print_equilibrium, result));
    kempe_equilibrium_free(result);
    return status;
}

const cli_command cli_equilibrium = {
    .bit = CLI_EQUILIBRIUM,
    .name = "equilibrium",
    .usage = "FILE [options]",
    .summary = "static or steady-state equilibrium and its stability",
    .examples = "  kempe equilibrium examples/four_bar/four_bar.yaml --global\n"
                "  kempe equilibrium examples/governor/governor.yaml --rates shaft=5.5\n"
                "  kempe equilibrium examples/governor/governor.yaml --rates shaft=5.5 --solve-for 'qd(shaft)' --hold "
                "slider=0.6\n",
    .dynamics = "plain",
    .run = equilibrium,
};
