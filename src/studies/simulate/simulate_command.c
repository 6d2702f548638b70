/* SPDX-License-Identifier: BSD-3-Clause */
#include "cli/command.h"
#include <limits.h>

static kempe_status print_trajectory(const void *object, kempe_format format, char **text)
{
    return kempe_trajectory_print(object, format, text);
}

static kempe_status simulate(const cli_job *j)
{
    kempe_trajectory *result = NULL;
    kempe_run_options run = j->settings->run;
    run.keep_independent = j->settings->keep_independent;
    run.no_convergence_check = j->settings->no_convergence_check;
    run.threads = j->settings->threads < INT_MAX ? (int)j->settings->threads : INT_MAX;
    run.max_steps = (long)j->settings->max_steps;
    kempe_status status = kempe_simulate(j->system, &run, &result);
    cli_tell_failure(j, status, result != NULL);
    if (result) {
        status = cli_worse(status, cli_report(j, print_trajectory, result));
        if (j->settings->output)
            status = cli_worse(status, cli_tell_written(j, cli_write_trajectory(result, j->settings->output)));
    }
    kempe_trajectory_free(result);
    return status;
}

const cli_command cli_simulate = {
    .bit = CLI_SIMULATE,
    .name = "simulate",
    .usage = "FILE [options]",
    .summary = "simulate with one formulation; accuracy checks of the result",
    .examples = "  kempe simulate examples/andrews/andrews.yaml -o andrews.csv\n"
                "  kempe simulate examples/slider_crank/slider_crank.yaml --rtol 1e-8 --t-end 2 --output-step 0.01\n"
                "  kempe simulate examples/andrews/andrews.yaml --formulation dae --json -\n",
    .run = simulate,
};
