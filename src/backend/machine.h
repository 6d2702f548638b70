/* SPDX-License-Identifier: BSD-3-Clause */
/* A program prepared to run, with its workspace: one per thread. The back end is a row of backends.def and five
 * functions; it is hidden from callers. */
#pragma once

#include "base/context.h"
#include "base/text.h"
#include "base/thread_pool.h"
#include "symbolic/program.h"

typedef struct kmp_machine kmp_machine;

/** Operations of implicit blocks: averages over places, and equations that are solved by iteration; and the lists of
 * arguments, each of one block, that they were made for. */
typedef struct kmp_block_counts {
    kmp_counts averages, equations;
    int average_lists, equation_lists;
} kmp_block_counts;

typedef struct kmp_backend {
    const char *name;
    void *(*prepare)(const kmp_program *program); /* NULL: no memory */
    void (*release)(void *code);
    void (*set)(void *code, kmp_input_kind kind, const double *values);
    void (*run)(void *code, int stage);
    const double *(*outputs)(const void *code, int stage);
    void (*count)(const void *code, kmp_block_counts *counts);  /* adds those since it was prepared */
    void *(*share)(const kmp_program *program, kmp_team *team); /* for a thread pool; NULL: unused */
    bool native;                                                /* blocks are machine code at many places at once */
    kmp_team *team; /* the thread pool that shares the work of prepared programs: NULL in the table, set in a copy;
                       outlives it */
} kmp_backend;

/** NULL if no back end has this name. */
const kmp_backend *kmp_backend_find(const char *name);
/** The name of the variant for many runs of one program: the first row. */
const char *kmp_backend_default(void);
/** The back end that runs for a name (NULL: the default): the tape where this machine runs no machine code, with a
 * warning if it was asked for. NULL after a message: no back end has this name. */
const kmp_backend *kmp_backend_choose(kempe_context *context, const char *name);
/** ", back end tape": of a back end other than the default one, otherwise nothing. */
void kmp_backend_print(kmp_text *text, const char *name);
/** All names, with commas between. */
const char *kmp_backend_names(void);

/** The program must outlive the machine. NULL: no memory. Stage 0 must be run after the parameters are set. */
kmp_machine *kmp_machine_new(const kmp_program *program, const kmp_backend *backend);
void kmp_machine_free(kmp_machine *machine);

/** Sets the values of one input vector; values that the program does not read are ignored. */
void kmp_machine_set(kmp_machine *machine, kmp_input_kind kind, const double *values);

/** Operations of the machine's blocks since it was made. */
kmp_block_counts kmp_machine_count(const kmp_machine *machine);

/** Runs one stage, whose earlier stages are up to date, and returns its outputs in order (owned by the machine, valid
 * until the stage runs again). No allocation. */
const double *kmp_machine_run(kmp_machine *machine, int stage);

#define KMP_BACKEND(name) extern const kmp_backend kmp_backend_##name;
#include "backend/backends.def"
#undef KMP_BACKEND
