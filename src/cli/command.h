/* SPDX-License-Identifier: BSD-3-Clause */
/* A command and the functions that all commands share: a cli_command in a file `NAME_command.c` of its own, and a row
 * of commands.def. */
#ifndef KEMPE_CLI_COMMAND_H
#define KEMPE_CLI_COMMAND_H

#include "options.h"
#include <kempe/table.h>

/** Exit codes: a promise to scripts. */
enum {
    CLI_DONE = 0,
    CLI_FAILED = 1, /* the computation failed */
    CLI_INPUT = 2,  /* the model or reference is wrong */
    CLI_USAGE = 3,
    CLI_BUG = 4 /* a defect of Kempe, or no memory */
};

/** One command at work: with the model read, and its equations where the command needs them. */
typedef struct cli_job {
    const cli_settings *settings;
    kempe_context *context;
    kempe_model *model;
    kempe_system *system;
} cli_job;

typedef struct cli_command {
    unsigned bit; /* of options.h */
    const char *name, *usage, *summary, *examples;
    bool (*accepts)(const cli_settings *settings);     /* false after an error message; NULL: always */
    bool (*model_alone)(const cli_settings *settings); /* needs no equations; NULL: it needs them */
    bool without_model;                                /* FILE is not a model */
    const char *dynamics;                              /* the default algorithm of the equations; NULL: the model's */
    kempe_status (*run)(const cli_job *j);
} cli_command;

#define CLI_COMMAND(name) extern const cli_command cli_##name;
#include "commands.def"
#undef CLI_COMMAND

typedef kempe_status cli_print_fn(const void *object, kempe_format format, char **text);

/** A string literal of JSON, to be freed; NULL when there is no memory. */
char *cli_quoted(const char *s);

/** Prints text on stdout unless the JSON goes there, and the JSON where it was requested. */
kempe_status cli_report(const cli_job *j, cli_print_fn *print, const void *object);

/** Prints the error message, and writes a JSON object also when there is no result to print. */
void cli_tell_failure(const cli_job *j, kempe_status status, bool has_result);

/** The status of the computation counts; when that was fine, the status of telling about it. */
kempe_status cli_worse(kempe_status computed, kempe_status told);

/** Reports a file that could not be written; returns `written`. */
kempe_status cli_tell_written(const cli_job *j, kempe_status written);

/** Writes a table where the output option says, and frees it; `made` is the status of the function that gave it. */
kempe_status cli_write_table(const cli_job *j, kempe_status made, kempe_table **table);

/** A trajectory as CSV, or as .npz by the name's ending. */
kempe_status cli_write_trajectory(const kempe_trajectory *trajectory, const char *path);

/** Accepts any settings. */
bool cli_always(const cli_settings *settings);

/** Writes the JSON of a usage error to `json` (NULL: nowhere). Returns CLI_USAGE. */
int cli_refuse(const char *json);

/** Runs one command with its own context and returns the exit code. */
int cli_run(const cli_command *command, const cli_settings *settings);

#endif
