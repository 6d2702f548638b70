/* SPDX-License-Identifier: BSD-3-Clause */
#include "cli/command.h"

/* True if one view is requested: `show` prints one view at a time; equations and stats together are the passes. */
static bool one_view(const cli_settings *s)
{
    if (s->show_equations && s->show_stats && !s->show_model && !s->show_program)
        return true;
    if (s->show_model + s->show_equations + s->show_program + s->show_stats == 1)
        return true;
    cli_complain("show needs one of --model, --equations, --program, --stats");
    return false;
}

static bool is_model(const cli_settings *s)
{
    return s->show_model;
}

static kempe_status print_model(const void *object, kempe_format format, char **text)
{
    return kempe_model_print(object, format, text);
}

static kempe_status print_equations(const void *object, kempe_format format, char **text)
{
    return kempe_system_print(object, KEMPE_VIEW_EQUATIONS, format, text);
}

static kempe_status print_program(const void *object, kempe_format format, char **text)
{
    return kempe_system_print(object, KEMPE_VIEW_PROGRAM, format, text);
}

static kempe_status print_stats(const void *object, kempe_format format, char **text)
{
    return kempe_system_print(object, KEMPE_VIEW_STATS, format, text);
}

static kempe_status print_passes(const void *object, kempe_format format, char **text)
{
    return kempe_system_print(object, KEMPE_VIEW_PASSES, format, text);
}

static kempe_status show(const cli_job *j)
{
    const cli_settings *s = j->settings;
    kempe_status status;
    if (s->show_equations && s->show_stats)
        status = cli_report(j, print_passes, j->system);
    else if (s->show_model)
        status = cli_report(j, print_model, j->model);
    else if (s->show_equations)
        status = cli_report(j, print_equations, j->system);
    else if (s->show_program)
        status = cli_report(j, print_program, j->system);
    else
        status = cli_report(j, print_stats, j->system);
    return cli_worse(KEMPE_OK, status);
}

const cli_command cli_show = {
    .bit = CLI_SHOW,
    .name = "show",
    .usage = "FILE --model | --equations | --program | --stats",
    .summary = "print the parsed model, its equations or its program",
    .examples = "  kempe show examples/andrews/andrews.yaml --stats\n"
                "  kempe show examples/four_bar/four_bar.yaml --equations\n"
                "  kempe show examples/four_bar/four_bar.yaml --equations --stats\n",
    .accepts = one_view,
    .model_alone = is_model,
    .run = show,
};
