/* SPDX-License-Identifier: BSD-3-Clause */
#include "cli/command.h"
#include <kempe/linearize.h>

static kempe_status print_linearization(const void *object, kempe_format format, char **text)
{
    return kempe_linearization_print(object, format, text);
}

static kempe_status linearize(const cli_job *j)
{
    const cli_settings *s = j->settings;
    kempe_linearization *result = NULL;
    const kempe_linearize_options ask = {.at = s->at,
                                         .inputs = s->inputs,
                                         .outputs = s->outputs,
                                         .independent = s->run.independent,
                                         .backend = s->run.backend};
    kempe_status status = kempe_linearization_new(j->system, &ask, &result);
    cli_tell_failure(j, status, result != NULL);
    if (result) {
        status = cli_worse(status, cli_report(j, print_linearization, result));
        if (s->output)
            status = cli_worse(status, cli_tell_written(j, kempe_linearization_write_npz(result, s->output)));
    }
    kempe_linearization_free(result);
    return status;
}

const cli_command cli_linearize = {
    .bit = CLI_LINEARIZE,
    .name = "linearize",
    .usage = "FILE [options]",
    .summary = "linear state-space model about an equilibrium or the start",
    .examples =
        "  kempe linearize examples/four_bar/four_bar.yaml --at start\n"
        "  kempe linearize examples/suspension/suspension.yaml --inputs 'force(chassis.R.z)' --outputs q -o car.npz\n",
    .dynamics = "plain",
    .run = linearize,
};
