/* SPDX-License-Identifier: BSD-3-Clause */
/* A command and the functions that all commands share: a row of commands.c. */
#pragma once

#include "options.h"

#include <kempe/table.h>

/** Exit codes: a promise to scripts. */
enum {
    CLI_DONE = 0,
    CLI_FAILED = 1, /* the computation failed or ended early, or a file cannot be written */
    CLI_INPUT = 2,  /* the model or reference is wrong */
    CLI_USAGE = 3,
    CLI_BUG = 4,      /* a defect of Kempe, or no memory */
    CLI_UNTRUSTED = 5 /* complete, but a check of the result failed */
};

/** One command at work: with the model read, and its equations where the command needs them. */
typedef struct cli_job {
    const cli_settings *settings;
    kempe_context *context;
    kempe_model *model;
    kempe_system *system;
    /* A result folder. Of --from also the model that its instances are made of, and settings with the options of its
     * run. */
    kempe_table *earlier; /* of --against; NULL: not given */
    kempe_folder *folder;
    kempe_model *base;
    kempe_model
        *given; /* of which `model`, or `base`, is with another state at its start; NULL: they are as they were read */
    cli_settings own;
} cli_job;

typedef kempe_status cli_print_fn(const cli_job *j, const void *object, kempe_format format, char **text);

enum { CLI_MOST_FILES = 4 };

/** A computation with one result. */
typedef struct cli_study {
    kempe_status (*compute)(const cli_job *j, void **result); /* also after a failure there may be a result */
    cli_print_fn *print;
    void (*free)(void *result); /* NULL is allowed */
    /* The table that --output writes, or that --plot draws; NULL: the study has none. */
    kempe_status (*table)(const cli_job *j, const void *result, bool drawn, kempe_table **table);
    struct cli_file {
        size_t path; /* place of the path in cli_settings: none is written where that is NULL */
        kempe_status (*write)(const cli_job *j, void *result, const char *path);
    } files[CLI_MOST_FILES];
} cli_study;

typedef struct cli_command {
    unsigned bit; /* of options.h */
    const char *name, *summary, *examples;
    const char *usage;    /* NULL: FILE [options] */
    bool without_model;   /* FILE is not a model */
    bool gathers;         /* FILE is a result folder, whose page needs its model */
    bool opens_pages;     /* FILE may be a page instead of a model */
    bool model_alone;     /* needs no equations */
    const char *dynamics; /* the default algorithm of the equations; NULL: the model's */
    const char *wing;     /* of the library that it needs: the end of its option, KEMPE_..; NULL: none */
    const cli_study *study;
    kempe_status (*run)(const cli_job *j); /* instead of a study; neither: this build is without the wing */
} cli_command;

/** All commands, in the order of the help, up to one without a name. */
extern const cli_command cli_commands[];

/** A sentence about options that are missing, or that contradict each other; NULL: there is none. */
const char *cli_lacking(unsigned command, const cli_settings *settings);

/** Sets what a command takes where no option says it: `show` without a view prints the model. */
void cli_default(unsigned command, cli_settings *settings);

/** A path that is relative to the folder of this command; NULL: unknown. The caller frees it. */
char *cli_from_command(const char *relative);

/** `kempe new` (new.c), `kempe view` (view.c). */
kempe_status cli_new(const cli_job *j);
kempe_status cli_view(const cli_job *j);

/** Opens a page or an address with the user's browser, and waits until that has taken it; a name for sentences. */
bool cli_open_page(const char *address);
const char *cli_browser(void);

/** True if the name of a file is the name of an HTML page. */
bool cli_is_page(const char *file);

/** Complains that this build is without a wing, given as the end of its option. */
void cli_lacks_wing(const char *wing);

/** KEMPE_OK where pages can be written; otherwise the message is in the context, or was printed. */
kempe_status cli_check_report(void);

/** Computes, prints and writes the files. */
kempe_status cli_run_study(const cli_job *j, const cli_study *study);

/** Writes a string literal of JSON; the JSON of a command that has written a file. */
void cli_put_quoted(FILE *out, const char *s);
void cli_put_done(FILE *out, const char *path);

/** Prints text on stdout unless the JSON goes there, and the JSON where it was requested. */
kempe_status cli_report(const cli_job *j, cli_print_fn *print, const void *object);

/** Prints the error message, and writes a JSON object also when there is no result to print. */
void cli_report_failure(const cli_job *j, kempe_status status, bool has_result);

/** The status of the computation counts; when that was fine, the status of shown_loads about it. */
kempe_status cli_worse(kempe_status computed, kempe_status reported);

/** Reports a file that could not be written; returns `written`. */
kempe_status cli_report_written(const cli_job *j, kempe_status written);

/** Writes the JSON of a usage error to `json` (NULL: nowhere). Returns CLI_USAGE. */
int cli_refuse(const char *json);

/** Runs one command with its own context and returns the exit code. */
int cli_run(const cli_command *command, const cli_settings *settings);
