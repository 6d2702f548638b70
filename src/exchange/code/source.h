/* SPDX-License-Identifier: BSD-3-Clause */
/* The input of a language: the programs of the requested sets of equations, with the names and shapes of arguments and
 * results. Made once, read by the languages. */
#pragma once

#include "studies/show/sets.h"
#include <kempe/generate.h>

enum { KMP_MOST_CHOSEN = 32, KMP_CHOICE_NAME = 40 };

typedef struct kmp_chosen {
    char name[KMP_CHOICE_NAME]; /* as written in the request: "M_C", "M_C+h_J" */
    unsigned sets;
    bool in_place; /* conditions have the values of the state, not of modes */
} kmp_chosen;

typedef struct kmp_set_choice {
    kmp_chosen chosen[KMP_MOST_CHOSEN];
    int count;
    unsigned all;                 /* the union */
    kmp_derivation_request scene; /* all but its sets */
    kmp_events modes;             /* of friction that sticks: the scene's inputs */
    const char *scheme;           /* the name of the algorithm */
} kmp_set_choice;

/** KEMPE_E_ARGUMENT: a set, scheme or body that does not exist, or a set that is empty for this model. The choice stays
 * where it is and lives no longer than the generation. To be freed in any case. */
kempe_status kmp_choice_read(const kempe_model *model, const kempe_generate_options *generation,
                             kmp_set_choice *choice);
void kmp_choice_free(kmp_set_choice *choice);

/** An output of a routine: entries first, first + 1, ... of its program, row by row. */
typedef struct kmp_array {
    const char *name, *meaning;
    int rows, cols; /* cols 0: a vector */
    bool symmetric; /* then only entries with column <= row */
    int first, count;
} kmp_array;

/** The equations of one choice as one program: stage 0 for the parameters, stage 1 for all else. */
typedef struct kmp_code_routine {
    char name[KMP_CHOICE_NAME]; /* part of identifiers: "M_C_h" */
    kmp_program *program;
    kmp_tally tally;
    kmp_array arrays[KMP_EQ_SETS];
    int array_count;
    unsigned arguments; /* bits 1 << kmp_argument_of; fixed by sets, options, and whether the model has inputs, friction
                         * that sticks, and forces that depend on multipliers */
    int *kept; /* by value of stage 0 and parameter: 1 + its position in k, which stage 1 reads; 0: not needed */
    int kept_count;
    struct kmp_code_block *blocks; /* of its program's implicit blocks; NULL: it has none */
    const char *inner;             /* of a block's routine: its name; otherwise NULL */
} kmp_code_routine;

/** Elements with modes: their rows of h, and where each begins in the argument modes. */
typedef struct kmp_code_elements {
    int count;
    char **names;
    int *row, *mode;
    const kmp_force **force;
} kmp_code_elements;

typedef struct kmp_code_source {
    kmp_arena arena; /* of all arrays */
    kempe_context *context;
    const kempe_model *model;
    struct kmp_variant *meant; /* of a rounded drawing, owns the model; NULL: the model is the caller's */
    char *title, *name;        /* the model's name; as an identifier */
    char hash[17];
    const char *scheme;
    bool parameters; /* numbers are kept as symbols: there are p and k */
    bool inputs, legible, vectorised;
    bool simulator;       /* all conditions are inputs: entries of `modes` */
    int n, m, body_count; /* bodies with inputs: 3 entries of force and torque each, ground not counted */
    char **coordinate_names, **row_names, **input_names, **output_names;
    int input_count, *input_order;                   /* of the model; the highest derivative that is read of each */
    int output_count;                                /* columns of the outputs */
    kmp_code_elements frictions, contacts, elements; /* friction that sticks; rigid contacts; both, without rows */
    int mode_entries;                                /* in modes, of each element */
    int discrete_count, *discrete_place;             /* states with samples or events: where each is in qd */
    char **discrete_names;
    double *discrete_time;                       /* between samples; INFINITY: of events */
    int delay_count, *delay_place, *delay_given; /* continuous delays: where each is in qd; 1 if `before` is */
    char **delay_names;
    int symbol_count, parameter_count;
    int *place; /* by symbol: its position in p, -1: no routine needs it */
    double *value;
    char **parameter_name; /* by position, like value */
    kmp_code_routine *routines;
    int count;
    const struct kmp_table **tables; /* of all routines and of their blocks, each once */
    int table_count;
    struct kmp_start_choice *choice; /* of coordinates and rows; NULL: the language needs none */
    struct kmp_simulated *simulated; /* of a simulator: what it has in addition to its equations; otherwise NULL */
} kmp_code_source;

kempe_status kmp_source_init(kmp_code_source *source, const kempe_model *model,
                             const kempe_generate_options *generation);

/** Only the names and numbers, without equations: of a system that the library itself simulates. Its parameters are
 * the parameters of the model that a caller may set. `simulated` has no states and no conditions. */
kempe_status kmp_source_describe(kmp_code_source *source, const kempe_model *model, const kempe_system *system);
void kmp_source_free(kmp_code_source *source);

/** Sets members of a routine that follow from its program; arrays and arguments are set before. False: no memory. */
bool kmp_code_take_program(kmp_code_source *source, kmp_code_routine *routine);

/** Finds the values of the parameters that stage 1 of a routine needs. False: no memory. */
bool kmp_code_find_kept(kmp_arena *arena, kmp_code_routine *routine);

/** Arguments of routines: a kind of input of the graph each, and the inputs of the model, which follow t there. */
enum { KMP_ARGUMENT_INPUTS = KMP_IN_COUNT, KMP_ARGUMENTS };

/** All routines of a simulator have the same arguments, but for the direction. */
enum {
    KMP_SIMULATOR_ARGUMENTS = 1 << KMP_IN_TIME | 1 << KMP_IN_Q | 1 << KMP_IN_QD | 1 << KMP_IN_QDD | 1 << KMP_IN_LAMBDA |
                              1 << KMP_IN_MODE | 1 << KMP_IN_CHART | 1 << KMP_ARGUMENT_INPUTS
};

/** The names of arguments: k, t, q .. u */
extern const char *const kmp_argument_names[KMP_ARGUMENTS];

/** Entries of `modes` for an element: the inputs of its first roles, with the input of KMP_ROLE_RATE where a friction
 * slips in two directions. */
enum { KMP_MODE_ENTRIES = KMP_ROLE_RATE - KMP_ROLE_SENSE, KMP_MODE_ENTRIES_ACROSS };

/** The argument in which a program's input is, and its place there. */
int kmp_argument_of(const kmp_program_input *input);
int kmp_place_in_argument(const kmp_code_source *source, const kmp_program_input *input);

/** True if a routine looks up the table, or a part of its blocks does; its number among the written ones, -1: it
 * is not among them. */
bool kmp_code_has_table(const kmp_code_routine *routine, const struct kmp_table *table);
int kmp_code_table_number(const kmp_code_source *source, const struct kmp_table *table);

/** Files as they are written: name and text. */
typedef struct kmp_code_file {
    char *name;
    kmp_text text;
} kmp_code_file;

typedef struct kmp_code_files {
    kmp_code_file *file;
    int count;
} kmp_code_files;

/** A new file with this name; its text to be filled, owned by the files. NULL: no memory. */
kmp_text *kmp_code_add(kmp_code_files *files, const char *format, ...) __attribute__((format(printf, 2, 3)));
void kmp_code_files_free(kmp_code_files *files);
