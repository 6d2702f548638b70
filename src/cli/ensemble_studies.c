/* SPDX-License-Identifier: BSD-3-Clause */
#include "study.h"

#include <kempe/ensemble.h>
#include <stdlib.h>

TABLE(kempe_ensemble_result, "instances")
REPORT_WRITER(kempe_fit_write_report)
REPORT_WRITER(kempe_optimum_write_report)

/* The estimates; a picture has the fitted motion and the data. */
static kempe_status kempe_fit_rows(const cli_job *j, const void *fit, bool drawn, kempe_table **table)
{
    (void)j;
    return kempe_fit_table(fit, drawn ? "first" : "parameters", table);
}

STUDY(fit, kempe_fit, kempe_fit_new(j->model, &s->fit, result), .table = kempe_fit_rows,
      .files = {REPORT(kempe_fit_write_report)})

/* The parameters; a picture has the course of the search. */
static kempe_status kempe_optimum_rows(const cli_job *j, const void *optimum, bool drawn, kempe_table **table)
{
    (void)j;
    return kempe_optimum_table(optimum, drawn ? "history" : "parameters", table);
}

STUDY(optimize, kempe_optimum, kempe_optimum_new(j->model, &s->optimize, result), .table = kempe_optimum_rows,
      .files = {REPORT(kempe_optimum_write_report)})

/* An ensemble, with the batch of its instances, or the folder into which it runs. */
typedef struct instances {
    kempe_values *values;
    kempe_ensemble *ensemble;
    kempe_ensemble_result *batch;
    kempe_folder *folder;
} instances;

static void instances_free(void *object)
{
    instances *i = object;
    if (!i)
        return;
    kempe_folder_free(i->folder);
    kempe_ensemble_result_free(i->batch);
    kempe_ensemble_free(i->ensemble);
    kempe_values_free(i->values);
    free(i);
}

static kempe_status instances_compute(const cli_job *j, void **object)
{
    const cli_settings *s = j->settings;
    const kempe_ensemble_options measured = {.size = sizeof measured, .quantities = s->quantities, .limits = s->limits};
    const int lanes = s->alone ? -1 : s->lanes;
    instances *i = calloc(1, sizeof *i);
    kempe_status status = !i          ? KEMPE_E_MEMORY
                          : s->values ? kempe_values_read(j->model, s->values, &i->values)
                          : s->sample.ranges
                              ? kempe_values_sample(j->model, &s->sample, &i->values)
                              : kempe_values_new(j->model, 0, NULL, 1, NULL, &i->values); /* the model itself */
    if (status == KEMPE_OK)
        status = kempe_ensemble_new_with(j->model, i->values, &measured, &i->ensemble);
    if (status == KEMPE_OK && s->out) {
        status = kempe_ensemble_run_folder(i->ensemble, &s->run, lanes, s->out, &s->folder, &i->folder);
        status = status == KEMPE_E_IO ? KEMPE_E_FAILED : status; /* an output that cannot be written */
    } else if (status == KEMPE_OK) {
        kempe_run_options run = s->run;
        run.output_step = 0; /* of histories */
        status = kempe_ensemble_run(i->ensemble, &run, lanes, &i->batch);
    }
    if (i && (i->batch || i->folder))
        *object = i;
    else
        instances_free(i);
    return status;
}

static kempe_status instances_print(const cli_job *j, const void *object, kempe_format format, char **text)
{
    const instances *i = object;
    (void)j;
    return i->folder ? kempe_folder_print(i->folder, format, text)
                     : kempe_ensemble_result_print(i->batch, format, text);
}

static kempe_status instances_table(const cli_job *j, const void *object, bool drawn, kempe_table **table)
{
    const instances *i = object;
    return kempe_ensemble_result_rows(j, i->batch, drawn, table);
}

#ifdef KEMPE_REPORT
static kempe_status instances_report(const cli_job *j, void *object, const char *path)
{
    const instances *i = object;
    (void)j;
    return kempe_ensemble_result_write_report(i->batch, path);
}
#endif

static kempe_status instances_history(const cli_job *j, void *object, const char *path)
{
    const instances *i = object;
    kempe_table *table = NULL;
    kempe_status status = kempe_ensemble_history(i->ensemble, &j->settings->run, j->settings->folder.history, &table);
    if (status == KEMPE_OK && j->settings->units)
        kempe_table_name_units(table);
    if (status == KEMPE_OK)
        status = kempe_table_write(table, path);
    kempe_table_free(table);
    return status;
}

#ifdef KEMPE_REPORT
#define INSTANCES_REPORT                                                                                               \
    {                                                                                                                  \
        AT(report), instances_report                                                                                   \
    }
#else
#define INSTANCES_REPORT                                                                                               \
    {                                                                                                                  \
        0, NULL                                                                                                        \
    }
#endif

const cli_study cli_ensemble_study = {.compute = instances_compute,
                                      .print = instances_print,
                                      .free = instances_free,
                                      .table = instances_table,
                                      .files = {INSTANCES_REPORT, {AT(history_output), instances_history}}};

static kempe_status print_folder(const cli_job *j, const void *object, kempe_format format, char **text)
{
    (void)j;
    return kempe_folder_print(object, format, text);
}

/* A part that is damaged, and an output that cannot be written, are not wrong input. */
static kempe_status gathered(kempe_status status)
{
    return status == KEMPE_E_IO || status == KEMPE_E_INPUT ? KEMPE_E_FAILED : status;
}

/* A doubt about instances stops no output. */
static bool is_complete(kempe_status status)
{
    return status == KEMPE_OK || status == KEMPE_UNTRUSTED;
}

/* Checks the parts, and writes the tables and the page that are requested. */
kempe_status cli_gather(const cli_job *j)
{
    const cli_settings *s = j->settings;
    kempe_status status = s->report ? cli_check_report() : KEMPE_OK;
#ifdef KEMPE_REPORT
    if (status == KEMPE_OK && s->report)
        status = kempe_folder_write_report(j->folder, j->model, s->report);
#endif
    bool wrong = status == KEMPE_E_INPUT;
    if (is_complete(status) && s->output)
        status = cli_worse(status, gathered(kempe_folder_write(j->folder, s->output, s->units != NULL)));
    else if (status == KEMPE_OK && !s->report)
        status = gathered(kempe_folder_check(j->folder));
    if (is_complete(status) && s->history_output)
        status =
            cli_worse(status, gathered(kempe_folder_write_history(j->folder, s->history_output, s->units != NULL)));
    bool ended = status != KEMPE_STOPPED && !wrong;
    cli_report_failure(j, status, ended);
    return ended ? cli_worse(status, cli_report(j, print_folder, j->folder)) : status;
}
