/* SPDX-License-Identifier: BSD-3-Clause */
#include "cli/command.h"
#include <kempe/inverse.h>
#include <kempe/table.h>

static kempe_status print_inverse(const void *object, kempe_format format, char **text)
{
    return kempe_inverse_print(object, format, text);
}

static kempe_status inverse(const cli_job *j)
{
    kempe_inverse *result = NULL;
    kempe_inverse_options ask = j->settings->inverse;
    ask.independent = j->settings->run.independent;
    ask.t_end = j->settings->run.t_end;
    ask.output_step = j->settings->run.output_step;
    ask.backend = j->settings->run.backend;
    ask.no_convergence_check = j->settings->no_convergence_check;
    kempe_status status = kempe_inverse_new(j->system, &ask, &result);
    cli_tell_failure(j, status, result != NULL);
    if (result) {
        status = cli_worse(status, cli_report(j, print_inverse, result));
        kempe_table *rows = NULL;
        if (j->settings->output)
            status = cli_worse(status, cli_write_table(j, kempe_inverse_table(result, "rows", &rows), &rows));
    }
    kempe_inverse_free(result);
    return status;
}

const cli_command cli_inverse = {
    .bit = CLI_INVERSE,
    .name = "inverse",
    .usage = "FILE [options]",
    .summary = "inverse dynamics: actuator forces and torques for a prescribed motion",
    .examples = "  kempe inverse examples/driven_slider_crank/driven_slider_crank.yaml\n"
                "  kempe inverse examples/stewart/led.yaml --actuators slide1,slide2,slide3,slide4,slide5,slide6 -o "
                "legs.csv\n"
                "  kempe inverse examples/parallel_robot/parallel_robot.yaml --actuators a1,b1,a2 --weights a2=4\n",
    .dynamics = "plain",
    .run = inverse,
};
