/* SPDX-License-Identifier: BSD-3-Clause */
#include "cli/command.h"
#include <kempe/response.h>

static kempe_status print_response(const void *object, kempe_format format, char **text)
{
    return kempe_response_print(object, format, text);
}

static kempe_status respond(const cli_job *j)
{
    const cli_settings *s = j->settings;
    kempe_response *result = NULL;
    const kempe_response_options ask = {.at = s->at,
                                        .inputs = s->inputs,
                                        .outputs = s->outputs,
                                        .frequencies = s->frequencies,
                                        .linear = s->linear,
                                        .independent = s->run.independent,
                                        .backend = s->run.backend};
    kempe_status status = kempe_response_new(j->system, &ask, &result);
    cli_tell_failure(j, status, result != NULL);
    if (result) {
        status = cli_worse(status, cli_report(j, print_response, result));
        if (s->output)
            status = cli_worse(status, cli_tell_written(j, kempe_response_write_csv(result, s->output)));
        if (s->svg)
            status = cli_worse(status, cli_tell_written(j, kempe_response_write_svg(result, s->svg)));
    }
    kempe_response_free(result);
    return status;
}

const cli_command cli_response = {
    .bit = CLI_RESPONSE,
    .name = "response",
    .usage = "FILE --inputs NAME,.. [options]",
    .summary = "frequency response: amplitude and phase of outputs for harmonic inputs, resonances",
    .examples = "  kempe response examples/suspension/suspension.yaml --inputs 'force(chassis.R.z)' \\\n"
                "      --outputs 'position(chassis.R).z' --frequencies 0.2:20 --svg car.svg\n",
    .dynamics = "plain",
    .run = respond,
};
