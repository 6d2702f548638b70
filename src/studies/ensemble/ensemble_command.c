/* SPDX-License-Identifier: BSD-3-Clause */
#include "cli/command.h"
#include <kempe/ensemble.h>

static bool says_which_instances(const cli_settings *s)
{
    if (!s->values == !s->sample)
        cli_complain("ensemble needs either --values CSV or --sample NAME=A:B,..");
    return !s->values != !s->sample;
}

static kempe_status print_batch(const void *object, kempe_format format, char **text)
{
    return kempe_batch_print(object, format, text);
}

static kempe_status take_values(const cli_job *j, kempe_values **values)
{
    const cli_settings *s = j->settings;
    double count = s->instances > 0 ? s->instances : 1000;
    if (s->values)
        return kempe_values_read(j->model, s->values, values);
    return kempe_values_sample(j->model, s->sample, count < 1e9 ? (int)count : 0,
                               s->seed > 0 && s->seed < 1e9 ? (int)s->seed : 1, values);
}

static kempe_status ensemble(const cli_job *j)
{
    const cli_settings *s = j->settings;
    kempe_values *values = NULL;
    kempe_ensemble *many = NULL;
    kempe_batch *result = NULL;
    kempe_run_options run = s->run;
    run.no_convergence_check = s->no_convergence_check;
    kempe_status status = take_values(j, &values);
    if (status == KEMPE_OK)
        status = kempe_ensemble_new(j->model, values, &many);
    run.max_steps = (long)s->max_steps;
    if (status == KEMPE_OK)
        status = kempe_ensemble_run(many, &run, s->alone ? -1 : s->lanes < 100 ? (int)s->lanes : 100, &result);
    cli_tell_failure(j, status, result != NULL);
    if (result) {
        status = cli_worse(status, cli_report(j, print_batch, result));
        if (s->output)
            status = cli_worse(status, cli_tell_written(j, kempe_batch_write_csv(result, s->output)));
    }
    kempe_batch_free(result);
    kempe_ensemble_free(many);
    kempe_values_free(values);
    return status;
}

const cli_command cli_ensemble = {
    .bit = CLI_ENSEMBLE,
    .name = "ensemble",
    .usage = "FILE --values CSV | --sample RANGES [options]",
    .summary = "simulate many instances with different parameters, in parallel vector lanes",
    .examples =
        "  kempe ensemble examples/four_bar/four_bar.yaml --values bars.csv -o ends.csv\n"
        "  kempe ensemble examples/four_bar/four_bar.yaml --sample crank=0.28:0.32,base=0.85:0.95 --instances 10000\n",
    .accepts = says_which_instances,
    .model_alone = cli_always,
    .run = ensemble,
};
