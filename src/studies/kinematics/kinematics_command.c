/* SPDX-License-Identifier: BSD-3-Clause */
#include "cli/command.h"
#include <kempe/kinematics.h>

static bool says_what_to_drive(const cli_settings *s)
{
    if (!s->kinematics.sweep)
        cli_complain("the swept coordinate is missing: give --sweep NAME=A:B");
    return s->kinematics.sweep;
}

static kempe_status print_kinematics(const void *object, kempe_format format, char **text)
{
    return kempe_kinematics_print(object, format, text);
}

static kempe_status kinematics(const cli_job *j)
{
    const cli_settings *s = j->settings;
    kempe_kinematics_options ask = s->kinematics;
    kempe_kinematics *result = NULL;
    kempe_status status = kempe_kinematics_new(j->system, &ask, &result);
    cli_tell_failure(j, status, result != NULL);
    if (result) {
        status = cli_worse(status, cli_report(j, print_kinematics, result));
        if (s->output)
            status = cli_worse(status, cli_tell_written(j, kempe_kinematics_write_csv(result, s->output)));
        if (s->svg)
            status = cli_worse(status, cli_tell_written(j, kempe_kinematics_write_svg(result, s->svg)));
    }
    kempe_kinematics_free(result);
    return status;
}

const cli_command cli_kinematics = {
    .bit = CLI_KINEMATICS,
    .name = "kinematics",
    .usage = "FILE --sweep NAME=A:B[,NAME=A:B..] [options]",
    .summary = "position analysis: sweep coordinates; velocities, accelerations, dead centres",
    .examples =
        "  kempe kinematics examples/four_bar/four_bar.yaml --sweep \"A=0 deg:360 deg\" -o turn.csv\n"
        "  kempe kinematics examples/driven_slider_crank/driven_slider_crank.yaml --sweep t=0:1:101\n"
        "  kempe kinematics examples/chebyshev/chebyshev.yaml --sweep \"crank=0 deg:360 deg\" --svg paths.svg\n",
    .accepts = says_what_to_drive,
    .dynamics = "plain",
    .run = kinematics,
};
