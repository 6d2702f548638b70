/* SPDX-License-Identifier: BSD-3-Clause */
#include "cli/command.h"
#include <kempe/sensitivity.h>

static kempe_status print_sensitivity(const void *object, kempe_format format, char **text)
{
    return kempe_sensitivity_print(object, format, text);
}

static kempe_status sensitivity(const cli_job *j)
{
    const cli_settings *settings = j->settings;
    kempe_sensitivity_options ask = settings->sensitivity;
    kempe_sensitivity *s = NULL;
    ask.integral = settings->integral;
    ask.run = settings->run;
    ask.run.no_convergence_check = settings->no_convergence_check;
    ask.run.max_steps = (long)settings->max_steps;
    kempe_status status = kempe_sensitivity_new(j->model, &ask, &s);
    cli_tell_failure(j, status, s != NULL);
    if (s) {
        status = cli_worse(status, cli_report(j, print_sensitivity, s));
        if (settings->output)
            status = cli_worse(status, cli_tell_written(j, kempe_sensitivity_write_csv(s, settings->output)));
    }
    kempe_sensitivity_free(s);
    return status;
}

const cli_command cli_sensitivity = {
    .bit = CLI_SENSITIVITY,
    .name = "sensitivity",
    .usage = "FILE [options]",
    .summary = "exact sensitivities with respect to parameters of the model",
    .examples =
        "  kempe sensitivity examples/four_bar/four_bar.yaml --parameters crank,base --t-end 1 -o by_lengths.csv\n"
        "  kempe sensitivity examples/stewart/stewart.yaml --method adjoint --outputs 'position(platform.P1).z'\n",
    .model_alone = cli_always,
    .run = sensitivity,
};
