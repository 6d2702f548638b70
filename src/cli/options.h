/* SPDX-License-Identifier: BSD-3-Clause */
/* The options of all commands: one table, one parser, one settings struct. */
#pragma once

#include <kempe/comfort.h>
#include <kempe/compare.h>
#include <kempe/ensemble.h>
#include <kempe/equilibrium.h>
#include <kempe/fit.h>
#include <kempe/generate.h>
#include <kempe/inverse.h>
#include <kempe/kempe.h>
#include <kempe/kinematics.h>
#include <kempe/limit_cycles.h>
#include <kempe/modes.h>
#include <kempe/optimize.h>
#include <kempe/reduce.h>
#include <kempe/response.h>
#include <kempe/sensitivity.h>
#include <kempe/settings.h>
#include <kempe/vehicle.h>
#include <stdbool.h>
#include <stdio.h>

/* Commands as bits, so that a row of the option table lists its commands. */
enum {
    CLI_CHECK = 1,
    CLI_ASSEMBLE = 2,
    CLI_SIMULATE = 4,
    CLI_COMPARE = 8,
    CLI_SHOW = 16,
    CLI_GENERATE = 32,
    CLI_ENSEMBLE = 64,
    CLI_KINEMATICS = 128,
    CLI_INVERSE = 256,
    CLI_EQUILIBRIUM = 512,
    CLI_LINEARIZE = 1024,
    CLI_MODES = 2048,
    CLI_RESPONSE = 4096,
    CLI_SENSITIVITY = 8192,
    CLI_CONTACT = 16384,
    CLI_NEW = 32768,
    CLI_VIEW = 65536,
    CLI_GATHER = 131072,
    CLI_FIT = 262144,
    CLI_OPTIMIZE = 524288,
    CLI_FMU = 1048576,
    CLI_COMFORT = 2097152,
    CLI_CYCLES = 4194304,
    CLI_REDUCE = 8388608,
    CLI_LANGUAGE_SERVER = 16777216,
    CLI_WORKBENCH = 33554432,
    CLI_ALL = 67108863,
    CLI_MODELS = CLI_ALL & ~(CLI_NEW | CLI_REDUCE | CLI_LANGUAGE_SERVER | CLI_WORKBENCH), /* that read a model */
    CLI_TABLES = CLI_SIMULATE | CLI_KINEMATICS | CLI_INVERSE | CLI_RESPONSE | CLI_MODES | CLI_SENSITIVITY |
                 CLI_ENSEMBLE | CLI_CONTACT | CLI_COMPARE | CLI_FIT | CLI_OPTIMIZE | CLI_COMFORT |
                 CLI_CYCLES,                                                           /* with a table of results */
    CLI_SYSTEMS = CLI_TABLES | CLI_CHECK | CLI_ASSEMBLE | CLI_EQUILIBRIUM | CLI_GATHER /* with a system of units */
};

/* The user's settings. Texts point into argv; NULL and 0 mean not given. */
enum { CLI_MOST_SETS = 64, CLI_LIST_SIZE = 8192 };

typedef struct cli_settings {
    const char *file;
    const char *json, *output, *report, *animation, *against;
    kempe_setting sets[CLI_MOST_SETS]; /* --set NAME=VALUE */
    int set_count;
    const char *algorithm;
    const char *at;           /* the state at which motions begin */
    double closure_tolerance; /* < 0: not given */
    kempe_run_options run;
    kempe_compare_options compare;
    kempe_generate_options generation;
    kempe_fmu_options fmu;
    int unit_on_library;
    kempe_reduce_options reduce;
    char interfaces[CLI_LIST_SIZE];
    kempe_equilibrium_options equilibrium;
    kempe_kinematics_options kinematics;
    kempe_contact_options contact;
    kempe_inverse_options inverse;
    kempe_sample_options sample;
    char quantities[CLI_LIST_SIZE], limits[CLI_LIST_SIZE];
    kempe_sensitivity_options sensitivity; /* in addition to the outputs in `run` */
    kempe_fit_options fit;                 /* likewise */
    char fitted[CLI_LIST_SIZE], own[CLI_LIST_SIZE];
    const char *data_files[CLI_MOST_SETS]; /* of a fit, behind the first; fit.file_count */
    kempe_optimum_options optimize;        /* likewise */
    kempe_modes_options modes;
    kempe_limit_cycles_options cycles; /* in addition to the outputs in `run` */
    kempe_response_options response;   /* and of state spaces */
    kempe_comfort_options comfort;     /* in addition to the outputs in `run` */
    const char *svg, *plot, *x, *y, *values;
    const char *angle_unit, *units, *base, *left_out; /* units: a system of units, "": only named, in SI */
    const char *out, *from;                           /* result folders */
    const char *model;                                /* of a folder that is gathered */
    int instance;                                     /* of `from`, from 1 on */
    kempe_folder_options folder;
    const char *history_output;
    int seed, lanes;
    int count, branches, alone, all, no_cache, joint_limits, strict, quiet, help; /* flags: 0 or 1 */
    int show_model, show_equations, show_program, show_stats;
    int stdio;            /* of `language-server`: what it does without the word, too */
    int elements;         /* of `new`: the list of the library */
    const char *readable; /* folder that `workbench` reads */
    int port, no_browser;
    const char *show_as;
} cli_settings;

/** Reads the words after the command's name. False after an error message on stderr. */
bool cli_options_read(unsigned command, const char *command_name, int count, char **words, cli_settings *settings);

/** False after an error message: a file would be written that is read, or that is written by another option. */
bool cli_written_apart(unsigned command, const cli_settings *settings);

/** A file that the command writes, from option *k on, which is behind it then; NULL: there are no more. */
const char *cli_written(unsigned command, const cli_settings *settings, int *k);

/** Moves the files that the command writes into a folder: their names, which are then in `kept` (one that comes in a
 * folder is refused). False after an error message. */
bool cli_written_into(unsigned command, cli_settings *settings, const char *folder, char kept[CLI_LIST_SIZE]);

/** The systems of units that --units takes. */
extern const char *const cli_unit_systems[];

/** Prints "kempe: .." on stderr, and keeps this last sentence; returns false. */
bool cli_complain(const char *format, ...) __attribute__((format(printf, 1, 2)));
const char *cli_complaint(void);

/** The value of --json in a command line that may otherwise be invalid; NULL: none. */
const char *cli_json_word(int count, char **words);

/** An option as completion sees it: its value as in the help, NULL for a flag; the endings of its file, NULL: any. */
typedef struct cli_option_view {
    const char *name, *value, *ending;
    char letter; /* of its short form; 0: none */
} cli_option_view;

/** The k-th option of a command; false: there are no more. */
bool cli_option_look(unsigned command, int k, cli_option_view *view);

/** Prints the options of one command, one per line. */
void cli_options_print(unsigned command, FILE *out);

/** The word of `words` (NULL ends it) that is nearest to `word`, NULL when none is near. */
const char *cli_nearest(const char *word, const char *const *words);
