/* SPDX-License-Identifier: BSD-3-Clause */
/* A model's document, in any file format: Kempe's own YAML, or another one converted to YAML nodes. */
#pragma once

#include "model/files/yaml.h"

/** The files of a model, by their numbers, for formats whose files include others. */
typedef struct kmp_include_files {
    void *user;
    /** Reads a file in the folder of file `from`; its number, and its text, which kmp_free frees. NULL after an error,
     * which is at the place. */
    char *(*read)(void *user, kmp_place place, int from, const char *name, int *number, size_t *length);
    const char *(*name)(void *user, int number);
    /** Keeps a warning for the results of the model; `altered`: mechanics of the file is left out. */
    void (*note)(void *user, const char *line, bool altered);
} kmp_include_files;

/** Model files of other programs, which a wing (base/wings.h) converts to the document of YAML that a user would have
 * written. */
typedef struct kmp_document_wing {
    /** True by the ending of its name or by its first sign. */
    bool (*is_foreign)(const char *file, const char *text, size_t length);
    kempe_status (*load)(kempe_context *context, kmp_arena *arena, const char *file, int number, const char *text,
                         size_t length, kmp_base base, const kmp_include_files *beside, const kmp_yaml **root);
    /** Converts a document of YAML that is in a foreign format; otherwise `*root` is unchanged. */
    kempe_status (*convert)(kempe_context *context, kmp_arena *arena, const char *file, kmp_base base,
                            const kmp_include_files *beside, const kmp_yaml **root);
} kmp_document_wing;

/** True if a wing of this build reads the file. */
bool kmp_document_is_foreign(const char *file, const char *text, size_t length);

/** The contract of kmp_yaml_load. Text in another format begins with '<', is in a file with one of the endings in
 * formats.def, or has one of the keys there; `base` is the support of its root. */
kempe_status kmp_document_load(kempe_context *context, kmp_arena *arena, const char *file, int number, const char *text,
                               size_t length, kmp_base base, const kmp_include_files *beside, const kmp_yaml **root);
