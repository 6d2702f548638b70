/* SPDX-License-Identifier: BSD-3-Clause */
#include "cli/command.h"

#include <kempe/compare.h>
#include <kempe/modes.h>
#include <string.h>

static kempe_status print_modes(const void *object, kempe_format format, char **text)
{
    return kempe_modes_print(object, format, text);
}

static bool accepts(const cli_settings *settings)
{
    const kempe_modes_options *ask = &settings->modes;
    if (!settings->svg || ask->sweep || (ask->rates && strchr(ask->rates, ':')))
        return true;
    cli_complain("--svg draws a sweep: give --sweep NAME=A:B:N or --rates NAME=A:B:N");
    return false;
}

static kempe_status write_files(const cli_job *j, kempe_modes *result)
{
    const cli_settings *s = j->settings;
    kempe_status status = KEMPE_OK;
    if (s->output)
        status = cli_worse(status, cli_tell_written(j, kempe_modes_write_csv(result, s->output)));
    if (s->svg)
        status = cli_worse(status, cli_tell_written(j, kempe_modes_write_svg(result, s->svg)));
    if (s->report)
        status = cli_worse(status, cli_tell_written(j, kempe_modes_write_report(result, s->report)));
    return status;
}

static kempe_status modes(const cli_job *j)
{
    kempe_modes *result = NULL;
    kempe_status status = j->settings->report ? kempe_report_check(j->context) : KEMPE_OK;
    if (status == KEMPE_OK)
        status = kempe_modes_new(j->system, &j->settings->modes, &result);
    cli_tell_failure(j, status, result != NULL);
    if (result) {
        status = cli_worse(status, cli_report(j, print_modes, result));
        status = cli_worse(status, write_files(j, result));
    }
    kempe_modes_free(result);
    return status;
}

const cli_command cli_modes = {
    .bit = CLI_MODES,
    .name = "modes",
    .usage = "FILE [options]",
    .summary = "modal analysis: eigenvalues, damping and mode shapes; root locus over a parameter",
    .examples = "  kempe modes examples/quarter_car/quarter_car.yaml\n"
                "  kempe modes examples/quarter_car/quarter_car.yaml --sweep \"damper=0:6000:61\" --svg locus.svg\n"
                "  kempe modes examples/suspension/suspension.yaml --report modes.html\n",
    .accepts = accepts,
    .dynamics = "plain",
    .run = modes,
};
