/* SPDX-License-Identifier: BSD-3-Clause */
/* Whole files at once. A string is written by kempe_write_file; its steps are declared in base/temporary_file.h. */
#pragma once

#include "base/context.h"
#include "base/text.h"

typedef enum kmp_file_kind {
    KMP_FILE_MODEL,
    KMP_FILE_INCLUDED,
    KMP_FILE_MESH,
    KMP_FILE_MODES,
    KMP_FILE_MATRIX,
    KMP_FILE_POINTS,
    KMP_FILE_TABLE,
    KMP_FILE_PARQUET,
    KMP_FILE_CHECKPOINT,
    KMP_FILE_RECORD,
    KMP_FILE_SCRIPT,
    KMP_FILE_BINARY
} kmp_file_kind;

/** Reads a file of a kind, which has its bound: a regular one, no device or terminal, which have no end or wait;
 *  some may be pipes. `*text` ends with a zero that `*length` does not count (free with kmp_free). KEMPE_E_IO with the
 *  reason. */
kempe_status kmp_file_read(kempe_context *context, kmp_file_kind kind, const char *path, char **text, size_t *length);

/** Writes a text to a file and frees it in any case. KEMPE_E_MEMORY: the text has failed. Errors as kempe_write_file.
 * */
kempe_status kmp_file_write(kempe_context *context, const char *path, kmp_text *text);

/** The ending of a file's name with its point, ".csv"; "": it has none. */
const char *kmp_file_ending(const char *path);

/** Makes a folder unless it is there. KEMPE_E_IO with the system's reason. */
kempe_status kmp_folder_make(kempe_context *context, const char *path);
