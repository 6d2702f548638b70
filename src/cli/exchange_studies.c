/* SPDX-License-Identifier: BSD-3-Clause */
#include "platform/platform.h"
#include "study.h"

#include <stdlib.h>

STUDY(count, kempe_count, kempe_count_new(j->model, &s->generation, result), .table = NULL)

STUDY(code, kempe_code, kempe_code_new(j->model, &s->generation, result), .table = NULL)

/* Writes the files, then the report. */
kempe_status cli_generate(const cli_job *j)
{
    const char *folder = j->settings->output ? j->settings->output : ".";
    void *result = NULL;
    if (j->settings->count)
        return cli_run_study(j, &cli_count_study);
    kempe_status status = cli_code_study.compute(j, &result);
    cli_report_failure(j, status, result != NULL);
    if (result) {
        kempe_status written = cli_report_written(j, kempe_code_write(result, folder));
        status = cli_worse(status, written == KEMPE_OK ? cli_report(j, cli_code_study.print, result) : written);
    }
    cli_code_study.free(result);
    return status;
}

/* Next to the command where it was built, otherwise where it was installed. */
static char *find_library(void)
{
    char *built = cli_from_command(CLI_UNITS);
    if (built && kmp_path_readable(built))
        return built;
    free(built);
    return cli_from_command(CLI_TO_LIBRARIES "/" CLI_UNITS);
}

static kempe_status print_unit(const cli_job *j, const void *object, kempe_format format, char **text)
{
    (void)j;
    return kempe_fmu_export_print(object, format, text);
}

/* Writes the unit, then the report, which has its name and size. */
kempe_status cli_fmu(const cli_job *j)
{
    kempe_fmu_export *made = NULL;
    kempe_fmu_options options = j->settings->fmu;
    char *file = j->settings->unit_on_library ? find_library() : NULL; /* that belongs to this command */
    options.unit_file = file;
    kempe_status status = kempe_fmu_export_new(j->model, &options, &made);
    free(file);
    cli_report_failure(j, status, made != NULL);
    if (made) {
        kempe_status written = cli_report_written(j, kempe_fmu_export_write(made, j->settings->output));
        status = cli_worse(status, written == KEMPE_OK ? cli_report(j, print_unit, made) : written);
    }
    kempe_fmu_export_free(made);
    return status;
}

static kempe_status print_reduction(const cli_job *j, const void *object, kempe_format format, char **text)
{
    (void)j;
    return kempe_reduction_print(object, format, text);
}

/* Writes the body, then the report about it. */
kempe_status cli_reduce(const cli_job *j)
{
    kempe_reduction *made = NULL;
    kempe_status status = kempe_reduction_new(j->context, j->settings->file, &j->settings->reduce, &made);
    if (made)
        status = cli_worse(status, kempe_reduction_write(made, j->settings->output));
    cli_report_failure(j, status, false);
    if (status == KEMPE_OK)
        status = cli_report(j, print_reduction, made);
    kempe_reduction_free(made);
    return status;
}
