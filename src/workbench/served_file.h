/* SPDX-License-Identifier: BSD-3-Clause */
/* The model file of a workbench: its text with a version that grows whenever the file on disk has changed, by
 * any program. Several threads may use it. */
#pragma once

#include "base/context.h"
#include "base/json.h"
#include "platform/platform.h"
#include <pthread.h>

typedef struct kmp_served_file {
    pthread_mutex_t lock;
    kempe_context *context;     /* its own */
    char path[KMP_PATH_MOST];   /* whole, without links */
    char folder[KMP_PATH_MOST]; /* the part of the path before the name, with its separator */
    const char *name;           /* in the path */
    char *text;
    size_t length;
    long version;         /* from 1 on */
    bool gone;            /* the file was missing at the last look */
    kmp_path_state state; /* of the file that the text is of */
} kmp_served_file;

/** Reads the file. KEMPE_E_IO, with the message in `context`. Free it also then. */
kempe_status kmp_served_file_init(kmp_served_file *file, kempe_context *context, const char *path);
void kmp_served_file_free(kmp_served_file *file);

/** Looks at the disk. Its version; 0: the file is missing or is not a text, and `why` has a sentence. */
long kmp_served_file_look(kmp_served_file *file, kmp_text *why);

/** Writes {"name": .., "text": .., "version": ..}. */
void kmp_served_file_put(kmp_served_file *file, kmp_text *json);

/** Replaces the text as a whole where the file has this version, or had it before it was removed; the version becomes
 * the new one's. False: it has another one, and `why` has a sentence if it could not be written ("": another version).
 */
bool kmp_served_file_write(kmp_served_file *file, const char *text, long *version, kmp_text *why);
