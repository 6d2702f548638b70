/* SPDX-License-Identifier: BSD-3-Clause */
/* Functions that all commands share. Each command makes one result object and reports it: text on stdout, errors on
 * stderr, JSON at the path of --json. */
#include "command.h"
#include "confined.h"
#include "element_list.h"
#include "platform/platform.h"
#include "terminal.h"

#include <errno.h>
#include <kempe/cache.h>
#include <kempe/settings.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* -- the place of the command ------------------------------------------------------------------------- */

char *cli_from_command(const char *relative)
{
    char command[KMP_PATH_MOST];
    if (!kmp_path_of_command(command))
        return NULL;
    const size_t folder = kmp_path_folder(command), size = folder + strlen(relative) + 1;
    char *path = malloc(size);
    if (path)
        (void)snprintf(path, size, "%.*s%s", (int)folder, command, relative);
    return path;
}

/* -- signals -------------------------------------------------------------------------------------- */

static kempe_context *volatile interrupted_context;

static void on_interrupt(int number)
{
    (void)number;
    if (interrupted_context)
        kempe_context_interrupt(interrupted_context);
}

/* -- reporting ------------------------------------------------------------------------------------- */

static void complain(kempe_status status, const char *message)
{
    cli_terminal_error(status == KEMPE_E_INPUT ? "" : "kempe: ", message); /* file:line:column comes first */
}

static kempe_status write_json(const cli_job *j, const char *text)
{
    if (strcmp(j->settings->json, "-") != 0)
        return kempe_write_file(j->context, j->settings->json, text);
    size_t length = strlen(text);
    fputs(text, stdout);
    if (length == 0 || text[length - 1] != '\n')
        putchar('\n');
    return KEMPE_OK;
}

static kempe_status report_as(const cli_job *j, cli_print_fn *print, const void *object, kempe_format format)
{
    char *text;
    kempe_status status = print(j, object, format, &text);
    if (status)
        return status;
    if (format == KEMPE_JSON) {
        status = write_json(j, text);
    } else {
        cli_terminal_shows(text);
        fputs(text, stdout);
    }
    kempe_text_free(text);
    return status;
}

kempe_status cli_report(const cli_job *j, cli_print_fn *print, const void *object)
{
    const char *json = j->settings->json;
    kempe_status status = KEMPE_OK;
    cli_terminal_clear();
    if (!json || strcmp(json, "-") != 0)
        status = report_as(j, print, object, j->settings->all ? KEMPE_FULL_TEXT : KEMPE_TEXT);
    if (json && status == KEMPE_OK)
        status = report_as(j, print, object, KEMPE_JSON);
    if (status)
        complain(status, kempe_context_message(j->context));
    return status;
}

kempe_status cli_worse(kempe_status computed, kempe_status reported)
{
    if (computed < 0 || reported == KEMPE_OK)
        return computed;
    return reported == KEMPE_E_IO ? KEMPE_E_FAILED
                                  : reported; /* an output that cannot be written is not a wrong input */
}

void cli_put_quoted(FILE *out, const char *s)
{
    putc('"', out);
    for (; *s; s++) {
        unsigned char c = (unsigned char)*s;
        if (c == '"' || c == '\\')
            fprintf(out, "\\%c", c);
        else if (c < 0x20)
            fprintf(out, "\\u%04x", c);
        else
            putc(c, out);
    }
    putc('"', out);
}

void cli_put_done(FILE *out, const char *path)
{
    fprintf(out, "{\"status\": \"%s\", \"file\": ", kempe_outcome_text(KEMPE_OUTCOME_COMPLETE));
    cli_put_quoted(out, path);
    fputs("}\n", out);
}

/* The JSON of a failure before there was a result. */
static kempe_status report_failure(const cli_job *j, kempe_outcome outcome, const char *reason)
{
    FILE *out = kmp_text_stream();
    if (!out)
        return KEMPE_E_MEMORY;
    fputs("{\"model\": ", out);
    if (j->model)
        cli_put_quoted(out, kempe_model_name(j->model));
    else
        fputs("null", out);
    fprintf(out, ", \"status\": \"%s\", \"reason\": ", kempe_outcome_text(outcome));
    cli_put_quoted(out, reason);
    fputs(", \"build_s\": null}\n", out);
    char *text = kmp_text_stream_end(out);
    kempe_status status = text ? write_json(j, text) : KEMPE_E_MEMORY;
    free(text);
    if (status == KEMPE_E_IO)
        complain(status, kempe_context_message(j->context));
    return status;
}

void cli_report_failure(const cli_job *j, kempe_status status, bool has_result)
{
    static const char stopped[] = "interrupted before a result was available";
    if (status == KEMPE_STOPPED && !has_result) {
        complain(status, stopped);
        if (j->settings->json)
            report_failure(j, KEMPE_OUTCOME_STOPPED, stopped);
    }
    if (status == KEMPE_STOPPED && has_result)
        complain(status, "stopped before the end; the result has the reason");
    if (status >= 0)
        return;
    complain(status, kempe_context_message(j->context));
    if (j->settings->json && !has_result)
        report_failure(j, KEMPE_OUTCOME_FAILED, kempe_context_message(j->context));
}

kempe_status cli_report_written(const cli_job *j, kempe_status written)
{
    if (written)
        complain(written, kempe_context_message(j->context));
    return written;
}

/* A written file, of which the path is known to the terminal; returns the worse of both. */
static kempe_status note_file(const cli_job *j, kempe_status status, kempe_status written, const char *path)
{
    status = cli_worse(status, cli_report_written(j, written));
    if (written == KEMPE_OK)
        cli_terminal_written(path);
    return status;
}

/* The table as a file of numbers, or as curves of the columns that --x and --y name. */
static kempe_status write_table(const cli_job *j, const cli_study *study, const void *result, bool drawn)
{
    const cli_settings *s = j->settings;
    kempe_table *table = NULL;
    kempe_status status = study->table(j, result, drawn, &table);
    if (status == KEMPE_OK && s->units)
        kempe_table_name_units(table);
    if (status == KEMPE_OK && drawn)
        status = j->earlier ? kempe_table_write_picture_against(table, j->earlier, s->x, s->y, s->plot)
                            : kempe_table_write_picture(table, s->x, s->y, s->plot);
    else if (status == KEMPE_OK)
        status = kempe_table_write(table, s->output);
    kempe_table_free(table);
    return status;
}

static kempe_status write_files(const cli_job *j, const cli_study *study, void *result, kempe_status status)
{
    const cli_settings *s = j->settings;
    if (study->table && s->output)
        status = note_file(j, status, write_table(j, study, result, false), s->output);
    if (study->table && s->plot)
        status = note_file(j, status, write_table(j, study, result, true), s->plot);
    for (int k = 0; k < CLI_MOST_FILES; k++) { /* in builds without a wing some have no function */
        const char *const *path = (const void *)((const char *)s + study->files[k].path);
        if (study->files[k].write && *path)
            status = note_file(j, status, study->files[k].write(j, result, *path), *path);
    }
    return status;
}

void cli_lacks_wing(const char *wing)
{
    cli_complain("this build of Kempe is without KEMPE_%s: configure it with -DKEMPE_%s=ON", wing, wing);
}

kempe_status cli_check_report(void)
{
#ifdef KEMPE_REPORT
    return KEMPE_OK;
#else
    cli_lacks_wing("REPORT");
    return KEMPE_E_ARGUMENT;
#endif
}

kempe_status cli_run_study(const cli_job *j, const cli_study *study)
{
    void *result = NULL;
    kempe_status status = j->settings->report ? cli_check_report() : KEMPE_OK;
#ifndef KEMPE_PICTURE
    if (status == KEMPE_OK && j->settings->animation) {
        cli_lacks_wing("PICTURE");
        status = KEMPE_E_ARGUMENT;
    }
#endif
    if (status == KEMPE_OK)
        status = study->compute(j, &result);
    cli_report_failure(j, status, result != NULL);
    if (result)
        status = write_files(j, study, result, cli_worse(status, cli_report(j, study->print, result)));
    study->free(result);
    return status;
}

/* -- running one ----------------------------------------------------------------------------------- */

#ifdef KEMPE_ENSEMBLE
/* Options that the user has not given are taken from the folder's run. */
static void take_run_options(kempe_run_options *run, const kempe_folder *folder)
{
    kempe_run_options there;
    kempe_folder_run_options(folder, &there);
    if (run->rtol > 0) /* another relative tolerance changes the absolute one in proportion */
        there.atol *= run->rtol / there.rtol;
#define KMP_RUN_OPTION(name, type, key, engine, folder, ...)                                                           \
    KMP_RUN_IF_FOLDER_##folder(run->name = run->name != 0 ? run->name : there.name;)
#include "model/data/run_options.def"
#undef KMP_RUN_OPTION
    run->output_step = run->output_step > 0 ? run->output_step : there.output_step;
    run->no_convergence_check = run->no_convergence_check || there.no_convergence_check;
}
#endif

#define TRY(call)                                                                                                      \
    do {                                                                                                               \
        kempe_status tried = (call);                                                                                   \
        if (tried != KEMPE_OK)                                                                                         \
            return tried;                                                                                              \
    } while (0)

static kempe_status prepare(cli_job *j, const cli_command *command)
{
    const cli_settings *s = j->settings;
    bool equations = !command->model_alone && !s->show_model && !s->show_as;
    const char *folder = command->gathers ? s->file : s->from, *file = command->gathers ? s->model : s->file;
    TRY(kempe_context_set_angle_unit(j->context, s->angle_unit ? s->angle_unit : "rad"));
    TRY(kempe_context_set_units(j->context, s->units && *s->units ? s->units : "si"));
    TRY(kempe_context_set_base(j->context, s->base));
    TRY(kempe_context_set_joint_limits(j->context, s->joint_limits));
    TRY(kempe_context_set_strict(j->context, s->strict));
    TRY(kempe_context_set_left_out(j->context, s->left_out));
#ifdef KEMPE_ENSEMBLE
    if (folder)
        TRY(kempe_folder_open(j->context, folder, &j->folder));
    file = file ? file : kempe_folder_model_file(j->folder);
#else
    if (folder) {
        cli_lacks_wing("ENSEMBLE");
        return KEMPE_E_ARGUMENT;
    }
#endif
    if (s->against && !s->plot && (!s->report || command->bit != CLI_SIMULATE)) {
        cli_complain(command->bit == CLI_SIMULATE
                         ? "--against draws on the page of --report and in the picture of --plot: name one of them, too"
                         : "--against draws in the picture of --plot: name it, too");
        return KEMPE_E_ARGUMENT;
    }
    if (s->against)
        TRY(kempe_table_read(j->context, s->against, &j->earlier));
    if (!command->gathers || s->report)
        TRY(kempe_model_read_set(j->context, file, s->sets, s->set_count, &j->model));
    if (j->model && s->closure_tolerance >= 0)
        TRY(kempe_model_set_closure_tolerance(j->model, s->closure_tolerance));
    if (j->model && s->at) {
        j->given = j->model;
        j->model = NULL;
        TRY(kempe_model_start_in(j->given, s->at, &j->model));
    }
#ifdef KEMPE_ENSEMBLE
    if (s->from) {
        /* The model becomes an instance of the folder of --from. */
        j->base = j->model;
        j->model = NULL;
        j->own = *s;
        j->settings = &j->own;
        take_run_options(&j->own.run, j->folder);
        TRY(kempe_folder_model(j->folder, j->base, s->instance - 1, &j->model));
    }
#endif
    if (equations)
        TRY(kempe_system_new_with_algorithm(j->model, s->algorithm ? s->algorithm : command->dynamics, &j->system));
    return KEMPE_OK;
}

/* True if the folder of a file is there. */
static bool has_folder(const char *path)
{
    char folder[KMP_PATH_MOST];
    kmp_path_state state;
    const size_t length = kmp_path_folder(path);
    if (length == 0 || length >= sizeof folder)
        return true;
    memcpy(folder, path, length);
    folder[length] = '\0';
    return kmp_path_look(folder, &state) && state.kind == KMP_PATH_FOLDER;
}

/* Files are written where a folder is, and none of the model: before a long run, whose results would be lost. */
static kempe_status check_written(const cli_job *j, unsigned command)
{
    const char *path, *json = j->settings->json;
    for (int k = 0; (path = cli_written(command, j->settings, &k));) {
        if (kempe_context_is_source(j->context, path)) {
            cli_complain("'%s' is a file of the model, and would be written over: name another one", path);
            return KEMPE_E_ARGUMENT;
        }
        if (!has_folder(path)) {
            char why[KMP_PATH_MOST + 100];
            (void)snprintf(why, sizeof why, "cannot write '%s': %s", path, strerror(ENOENT));
            complain(KEMPE_E_FAILED, why);
            if (json && strcmp(json, path) != 0)
                report_failure(j, KEMPE_OUTCOME_FAILED, why);
            return KEMPE_E_FAILED;
        }
    }
    return KEMPE_OK;
}

static int exit_code(kempe_status status)
{
    switch (status) {
    case KEMPE_OK:
        return CLI_DONE;
    case KEMPE_UNTRUSTED:
        return CLI_UNTRUSTED;
    case KEMPE_STOPPED:
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

int cli_refuse(const char *json)
{
    static cli_settings settings;
    static cli_job j;
    settings.json = json;
    j.settings = &settings;
    j.context = json ? kempe_context_new() : NULL;
    if (j.context)
        report_failure(&j, KEMPE_OUTCOME_FAILED, cli_complaint());
    kempe_context_free(j.context);
    return CLI_USAGE;
}

int cli_run(const cli_command *command, const cli_settings *settings)
{
    static cli_job j; /* large: the stack may be small */
    j.settings = settings;
    j.context = kempe_context_new();
    if (!j.context) {
        fputs("kempe: out of memory\n", stderr);
        return CLI_BUG;
    }
    cli_terminal_begin(settings->quiet, !command->opens_pages);
    kempe_context_set_log(j.context, cli_terminal_log, NULL);
    double interval;
    if (cli_terminal_shows_progress(&interval))
        kempe_context_set_progress(j.context, interval, cli_terminal_progress, NULL);
    /* The first Ctrl-C or SIGTERM ends the run with its results so far, the second one ends the process. A file that
     * exceeds a limit is an error of its writing. */
    kempe_context *context = j.context;
    interrupted_context = context;
    kmp_interrupts_to(on_interrupt);
    /* Lets the context use the user's folder of cached equations, unless --no-cache. */
    char *folder = j.settings->no_cache ? NULL : kempe_cache_folder();
    kempe_status status = kempe_context_set_cache(j.context, folder);
    kempe_text_free(folder);
    if (status == KEMPE_OK && (status = cli_confine(j.context)) != KEMPE_OK)
        complain(status, kempe_context_message(j.context));
    const bool reads = !command->without_model && !(command->opens_pages && cli_is_page(settings->file)) &&
                       !(command->bit == CLI_SHOW && cli_is_element(settings->file));
    if (status == KEMPE_OK && reads) {
        status = prepare(&j, command);
        cli_report_failure(&j, status, false);
        if (status == KEMPE_OK)
            status = check_written(&j, command->bit);
    }
    if (status == KEMPE_OK)
        status = command->study ? cli_run_study(&j, command->study) : command->run(&j);
    interrupted_context = NULL;
    cli_terminal_shows("");
    kempe_table_free(j.earlier);
    kempe_system_free(j.system);
    kempe_model_free(j.model);
    kempe_model_free(j.given);
    kempe_model_free(j.base);
#ifdef KEMPE_ENSEMBLE
    kempe_folder_free(j.folder);
#endif
    kempe_context_free(j.context);
    return exit_code(status);
}
