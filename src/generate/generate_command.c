/* SPDX-License-Identifier: BSD-3-Clause */
#include "cli/command.h"
#include <kempe/generate.h>

static bool says_what_to_generate(const cli_settings *s)
{
    if (!s->count && !s->generation.language)
        cli_complain("generate needs --lang NAME, or --count");
    return s->count || s->generation.language;
}

static kempe_status print_count(const void *object, kempe_format format, char **text)
{
    return kempe_count_print(object, format, text);
}

static kempe_status print_code(const void *object, kempe_format format, char **text)
{
    return kempe_code_print(object, format, text);
}

static kempe_status count(const cli_job *j, const kempe_generate_options *generation)
{
    kempe_count *result = NULL;
    kempe_status status = kempe_count_new(j->model, generation, &result);
    cli_tell_failure(j, status, result != NULL);
    if (result)
        status = cli_worse(status, cli_report(j, print_count, result));
    kempe_count_free(result);
    return status;
}

/* Writes the files, then the report. */
static kempe_status generate(const cli_job *j)
{
    kempe_code *result = NULL;
    kempe_generate_options generation = j->settings->generation;
    generation.keep_parameters = j->settings->keep_parameters;
    generation.body_inputs = j->settings->body_inputs;
    generation.drives = j->settings->drives;
    generation.optimize = j->settings->optimize;
    generation.vectorised = j->settings->vectorised;
    if (j->settings->count)
        return count(j, &generation);
    kempe_status status = kempe_code_new(j->model, &generation, &result);
    cli_tell_failure(j, status, result != NULL);
    if (result) {
        const char *folder = j->settings->output ? j->settings->output : ".";
        kempe_status written = cli_tell_written(j, kempe_code_write(result, folder));
        status = cli_worse(status, written);
        if (written == KEMPE_OK)
            status = cli_worse(status, cli_report(j, print_code, result));
    }
    kempe_code_free(result);
    return status;
}

const cli_command cli_generate = {
    .bit = CLI_GENERATE,
    .name = "generate",
    .usage = "FILE --lang NAME | --count [options]",
    .summary = "generate equations in C, Octave or Python; operation counts",
    .examples =
        "  kempe generate examples/andrews/andrews.yaml --lang c -o andrews\n"
        "  kempe generate examples/andrews/andrews.yaml --count\n"
        "  kempe generate examples/andrews/andrews.yaml --count --sets M_C,invdyn --keep-parameters --body-inputs\n",
    .accepts = says_what_to_generate,
    .model_alone = cli_always,
    .run = generate,
};
