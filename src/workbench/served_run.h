/* SPDX-License-Identifier: BSD-3-Clause */
/* Commands that a workbench runs for its page: each is a process of the command kempe, confined to the folder of the
 * model (src/cli/confined.h), with a scratch folder for what it is given and what it writes. Several threads may begin,
 * ask for and stop commands. */
#pragma once

#include "base/text.h"
#include "language_server/json_value.h"
#include "platform/platform.h"
#include <pthread.h>
#include <stdatomic.h>

enum { KMP_MOST_RUNS = 4, KMP_RUN_NAME = 64 };

typedef struct kmp_served_run {
    bool taken;
    char name[KMP_RUN_NAME]; /* "": the page has given none */
    char scratch[KMP_PATH_MOST];
    atomic_bool stopped;
} kmp_served_run;

typedef struct kmp_served_runs {
    pthread_mutex_t lock;
    const char *command, *folder, *readable; /* not owned: folder of the model, and the one whose files are read */
    atomic_bool closing;                     /* running commands are to end */
    kmp_served_run run[KMP_MOST_RUNS];
} kmp_served_runs;

void kmp_served_runs_init(kmp_served_runs *runs, const char *command, const char *folder, const char *readable);

/** The end of a command. */
typedef enum kmp_run_end {
    KMP_RUN_ENDED,   /* `answer` is its result in JSON */
    KMP_RUN_REFUSED, /* the request is wrong, and `answer` a sentence */
    KMP_RUN_BUSY,    /* the most commands run already */
    KMP_RUN_FAILED,  /* the system does not let it run, and `answer` a sentence */
    KMP_RUN_GONE     /* the page has closed its connection, or the server ends */
} kmp_run_end;

/** Runs the command of a request until it ends. `socket`: of its connection. */
kmp_run_end kmp_served_run_command(kmp_served_runs *runs, const kmp_json_value *request, int socket, kmp_text *answer);

/** Writes {"running": .., "progress": ..} of a command by its name. */
void kmp_served_run_progress(kmp_served_runs *runs, const char *name, kmp_text *json);

/** Asks commands of this name to end with the result so far (NULL: all). True: there was one. */
bool kmp_served_run_stop(kmp_served_runs *runs, const char *name);
