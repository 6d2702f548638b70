/* SPDX-License-Identifier: BSD-3-Clause */
/* The commands. Each makes one result object and reports it: text on stdout, complaints on stderr, JSON
 * where --json says. */
#include "commands.h"

#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef struct job {
    const cli_settings *settings;
    kempe_context *context;
    kempe_model *model;
    kempe_system *system;
} job;

typedef kempe_status print_fn(const void *object, kempe_format format, char **text);

/* -- signals and log ------------------------------------------------------------------------------- */

static kempe_context *volatile interrupted_context;

static void on_interrupt(int number)
{
    (void)number;
    if (interrupted_context)
        kempe_context_interrupt(interrupted_context);
}

/* The first Ctrl-C ends the run with what it has, the second one ends the process. */
static void watch_interrupt(kempe_context *context)
{
    struct sigaction action = {.sa_flags = (int)SA_RESETHAND};
    action.sa_handler = on_interrupt;
    sigemptyset(&action.sa_mask);
    interrupted_context = context;
    sigaction(SIGINT, &action, NULL);
}

static void on_log(void *user, kempe_level level, const char *line)
{
    const bool *terminal = user;
    if (level == KEMPE_LOG_WARNING)
        fprintf(stderr, "kempe: warning: %s\n", line);
    else if (*terminal)
        fprintf(stderr, "%s\n", line);
}

/* -- reporting ------------------------------------------------------------------------------------- */

static void complain(kempe_status status, const char *message)
{
    const char *prefix = status == KEMPE_E_INPUT ? "" : "kempe: "; /* file:line:column comes first */
    while (*message) {
        int length = (int)strcspn(message, "\n");
        fprintf(stderr, "%s%.*s\n", prefix, length, message);
        message += length + (message[length] == '\n');
    }
}

static kempe_status write_json(const job *j, const char *text)
{
    if (strcmp(j->settings->json, "-") != 0)
        return kempe_write_file(j->context, j->settings->json, text);
    size_t length = strlen(text);
    fputs(text, stdout);
    if (length == 0 || text[length - 1] != '\n')
        putchar('\n');
    return KEMPE_OK;
}

static kempe_status report_as(const job *j, print_fn *print, const void *object, kempe_format format)
{
    char *text;
    kempe_status status = print(object, format, &text);
    if (status)
        return status;
    if (format == KEMPE_JSON)
        status = write_json(j, text);
    else
        fputs(text, stdout);
    kempe_text_free(text);
    return status;
}

/* Text on stdout unless the JSON goes there; the JSON where it was asked for. */
static kempe_status report(const job *j, print_fn *print, const void *object)
{
    const char *json = j->settings->json;
    kempe_status status = KEMPE_OK;
    if (!json || strcmp(json, "-") != 0)
        status = report_as(j, print, object, KEMPE_TEXT);
    if (json && status == KEMPE_OK)
        status = report_as(j, print, object, KEMPE_JSON);
    if (status)
        complain(status, kempe_context_message(j->context));
    return status;
}

/* The status of the computation counts; when that was fine, the status of telling about it. */
static kempe_status worse(kempe_status computed, kempe_status told)
{
    if (computed < 0 || told == KEMPE_OK)
        return computed;
    return told == KEMPE_E_IO ? KEMPE_E_FAILED : told; /* an output that cannot be written is no wrong input */
}

static size_t escape(char *out, const char *s)
{
    size_t n = 0;
    for (; *s; s++) {
        unsigned char c = (unsigned char)*s;
        if (c == '"' || c == '\\')
            n += (size_t)sprintf(out + n, "\\%c", c);
        else if (c < 0x20)
            n += (size_t)sprintf(out + n, "\\u%04x", c);
        else
            out[n++] = (char)c;
    }
    out[n] = 0;
    return n;
}

/* A string literal of JSON; NULL when there is no memory. */
static char *quoted(const char *s)
{
    char *out = malloc(6 * strlen(s) + 3);
    if (!out)
        return NULL;
    size_t n = escape(out + 1, s);
    out[0] = '"';
    memcpy(out + n + 1, "\"", 2);
    return out;
}

/* The JSON of a failure before there was a result. */
static kempe_status report_failure(const job *j, const char *reason)
{
    static const char *const format = "{\"model\": %s, \"status\": \"failed\", \"reason\": %s, \"build_s\": null}\n";
    char *why = quoted(reason), *name = j->model ? quoted(kempe_model_name(j->model)) : NULL;
    size_t size = strlen(format) + (why ? strlen(why) : 0) + (name ? strlen(name) : 4);
    char *text = malloc(size);
    kempe_status status = KEMPE_E_MEMORY;
    if (why && text && (name || !j->model)) {
        snprintf(text, size, format, name ? name : "null", why);
        status = write_json(j, text);
    }
    free(text);
    free(name);
    free(why);
    if (status == KEMPE_E_IO)
        complain(status, kempe_context_message(j->context));
    return status;
}

/* -- the commands ---------------------------------------------------------------------------------- */

static kempe_status print_check(const void *object, kempe_format format, char **text)
{
    return kempe_check_print(object, format, text);
}

static kempe_status print_assembly(const void *object, kempe_format format, char **text)
{
    return kempe_assembly_print(object, format, text);
}

static kempe_status print_branches(const void *object, kempe_format format, char **text)
{
    return kempe_branches_print(object, format, text);
}

static kempe_status print_trajectory(const void *object, kempe_format format, char **text)
{
    return kempe_trajectory_print(object, format, text);
}

static kempe_status print_batch(const void *object, kempe_format format, char **text)
{
    return kempe_batch_print(object, format, text);
}

static kempe_status print_comparison(const void *object, kempe_format format, char **text)
{
    return kempe_comparison_print(object, format, text);
}

static kempe_status print_count(const void *object, kempe_format format, char **text)
{
    return kempe_count_print(object, format, text);
}

static kempe_status print_code(const void *object, kempe_format format, char **text)
{
    return kempe_code_print(object, format, text);
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

/* Says what went wrong, and leaves a JSON object also when there is no result to print. */
static void tell_failure(const job *j, kempe_status status, bool has_result)
{
    if (status >= 0)
        return;
    complain(status, kempe_context_message(j->context));
    if (j->settings->json && !has_result)
        report_failure(j, kempe_context_message(j->context));
}

static kempe_status check(const job *j)
{
    kempe_check *result = NULL;
    kempe_status status = kempe_check_new(j->system, &result);
    tell_failure(j, status, result != NULL);
    if (result)
        status = worse(status, report(j, print_check, result));
    kempe_check_free(result);
    return status;
}

static kempe_status assemble(const job *j)
{
    kempe_assembly *result = NULL;
    kempe_status status = kempe_assemble(j->system, &result);
    tell_failure(j, status, result != NULL);
    if (result)
        status = worse(status, report(j, print_assembly, result));
    kempe_assembly_free(result);
    return status;
}

static kempe_status branches(const job *j)
{
    kempe_branches *result = NULL;
    double seed = j->settings->seed;
    kempe_status status = kempe_branches_new(j->system, seed > 0 && seed < 1e9 ? (int)seed : 1, &result);
    tell_failure(j, status, result != NULL);
    if (result)
        status = worse(status, report(j, print_branches, result));
    kempe_branches_free(result);
    return status;
}

static kempe_status tell_written(const job *j, kempe_status written)
{
    if (written)
        complain(written, kempe_context_message(j->context));
    return written;
}

/* The name's ending says the format. */
static kempe_status write_trajectory(const kempe_trajectory *trajectory, const char *path)
{
    size_t length = strlen(path);
    if (length > 4 && strcmp(path + length - 4, ".npz") == 0)
        return kempe_trajectory_write_npz(trajectory, path);
    return kempe_trajectory_write_csv(trajectory, path);
}

static kempe_status simulate(const job *j)
{
    kempe_trajectory *result = NULL;
    kempe_run run = j->settings->run;
    run.fixed_u = j->settings->fixed_u;
    run.once = j->settings->once;
    kempe_status status = kempe_simulate(j->system, &run, &result);
    tell_failure(j, status, result != NULL);
    if (result) {
        status = worse(status, report(j, print_trajectory, result));
        if (j->settings->output)
            status = worse(status, tell_written(j, write_trajectory(result, j->settings->output)));
    }
    kempe_trajectory_free(result);
    return status;
}

static kempe_status take_values(const job *j, kempe_values **values)
{
    const cli_settings *s = j->settings;
    double count = s->instances > 0 ? s->instances : 1000;
    if (s->values)
        return kempe_values_read(j->model, s->values, values);
    return kempe_values_sample(j->model, s->sample, count < 1e9 ? (int)count : 0,
                               s->seed > 0 && s->seed < 1e9 ? (int)s->seed : 1, values);
}

static kempe_status ensemble(const job *j)
{
    const cli_settings *s = j->settings;
    kempe_values *values = NULL;
    kempe_ensemble *many = NULL;
    kempe_batch *result = NULL;
    kempe_status status = take_values(j, &values);
    if (status == KEMPE_OK)
        status = kempe_ensemble_new(j->model, values, &many);
    if (status == KEMPE_OK)
        status = kempe_ensemble_run(many, &s->run, s->alone ? -1 : s->lanes < 100 ? (int)s->lanes : 100, &result);
    tell_failure(j, status, result != NULL);
    if (result) {
        status = worse(status, report(j, print_batch, result));
        if (s->output)
            status = worse(status, tell_written(j, kempe_batch_write_csv(result, s->output)));
    }
    kempe_batch_free(result);
    kempe_ensemble_free(many);
    kempe_values_free(values);
    return status;
}

static kempe_status compare(const job *j)
{
    kempe_comparison *result = NULL;
    kempe_status status = j->settings->report ? kempe_report_check(j->context) : KEMPE_OK;
    if (status == KEMPE_OK)
        status = kempe_compare(j->system, &j->settings->compare, &result);
    tell_failure(j, status, result != NULL);
    if (result) {
        status = worse(status, report(j, print_comparison, result));
        if (j->settings->csv)
            status = worse(status, tell_written(j, kempe_comparison_write_csv(result, j->settings->csv)));
        if (j->settings->report)
            status = worse(status, tell_written(j, kempe_comparison_write_report(result, j->settings->report)));
    }
    kempe_comparison_free(result);
    return status;
}

static kempe_status show(const job *j)
{
    const cli_settings *s = j->settings;
    kempe_status status;
    if (s->show_equations && s->show_stats)
        status = report(j, print_passes, j->system);
    else if (s->show_model)
        status = report(j, print_model, j->model);
    else if (s->show_equations)
        status = report(j, print_equations, j->system);
    else if (s->show_program)
        status = report(j, print_program, j->system);
    else
        status = report(j, print_stats, j->system);
    return worse(KEMPE_OK, status);
}

static kempe_status count(const job *j, const kempe_generation *generation)
{
    kempe_count *result = NULL;
    kempe_status status = kempe_count_new(j->model, generation, &result);
    tell_failure(j, status, result != NULL);
    if (result)
        status = worse(status, report(j, print_count, result));
    kempe_count_free(result);
    return status;
}

/* The report comes when the files are there. */
static kempe_status generate(const job *j)
{
    kempe_code *result = NULL;
    kempe_generation generation = j->settings->generation;
    generation.keep_parameters = j->settings->keep_parameters;
    generation.body_inputs = j->settings->body_inputs;
    generation.drives = j->settings->drives;
    generation.optimize = j->settings->optimize;
    generation.vectorised = j->settings->vectorised;
    if (j->settings->count)
        return count(j, &generation);
    kempe_status status = kempe_code_new(j->model, &generation, &result);
    tell_failure(j, status, result != NULL);
    if (result) {
        const char *folder = j->settings->output ? j->settings->output : ".";
        kempe_status written = tell_written(j, kempe_code_write(result, folder));
        status = worse(status, written);
        if (written == KEMPE_OK)
            status = worse(status, report(j, print_code, result));
    }
    kempe_code_free(result);
    return status;
}

/* -- running one ----------------------------------------------------------------------------------- */

static kempe_status prepare(job *j, bool equations)
{
    kempe_status status =
        kempe_model_read_set(j->context, j->settings->file, j->settings->sets, j->settings->set_count, &j->model);
    if (status == KEMPE_OK && equations)
        status = kempe_system_new_by(j->model, j->settings->dynamics, &j->system);
    tell_failure(j, status, false);
    return status;
}

static kempe_status dispatch(unsigned command, const job *j)
{
    switch (command) {
    case CLI_CHECK:
        return check(j);
    case CLI_ASSEMBLE:
        return j->settings->branches ? branches(j) : assemble(j);
    case CLI_SIMULATE:
        return simulate(j);
    case CLI_ENSEMBLE:
        return ensemble(j);
    case CLI_COMPARE:
        return compare(j);
    case CLI_GENERATE:
        return generate(j);
    default:
        return show(j);
    }
}

static int exit_code(kempe_status status)
{
    switch (status) {
    case KEMPE_OK:
    case KEMPE_STOPPED:
        return CLI_DONE;
    case KEMPE_E_FAILED:
        return CLI_FAILED;
    case KEMPE_E_INPUT:
    case KEMPE_E_IO: /* a model or reference that cannot be read: worse() has turned failed writing into failure */
        return CLI_INPUT;
    case KEMPE_E_ARGUMENT:
        return CLI_USAGE;
    case KEMPE_E_MEMORY:
    case KEMPE_E_BUG:
        break;
    }
    return CLI_BUG;
}

int cli_run(unsigned command, const cli_settings *settings)
{
    bool terminal = isatty(STDERR_FILENO);
    job j = {.settings = settings, .context = kempe_context_new()};
    if (!j.context) {
        fputs("kempe: out of memory\n", stderr);
        return CLI_BUG;
    }
    kempe_context_set_log(j.context, on_log, &terminal);
    watch_interrupt(j.context);
    bool model_alone =
        command == CLI_GENERATE || command == CLI_ENSEMBLE || (command == CLI_SHOW && settings->show_model);
    kempe_status status = prepare(&j, !model_alone);
    if (status == KEMPE_OK)
        status = dispatch(command, &j);
    interrupted_context = NULL;
    kempe_system_free(j.system);
    kempe_model_free(j.model);
    kempe_context_free(j.context);
    return exit_code(status);
}
