/* SPDX-License-Identifier: BSD-3-Clause */
/* Whole files at once. A string is written by kempe_write_file. */
#pragma once

#include "base/context.h"
#include "base/text.h"

typedef enum kmp_file_kind {
    KMP_FILE_MODEL,
    KMP_FILE_INCLUDED,
    KMP_FILE_MESH,
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

/** Writes files into a folder: all of them, or none where one cannot be written. Errors as kempe_write_file. */
kempe_status kmp_files_write(kempe_context *context, const char *folder, int count, const char *const *names,
                             const char *const *texts);

/** Writes a text to a file and frees it in any case. KEMPE_E_MEMORY: the text has failed. Errors as kempe_write_file.
 * */
kempe_status kmp_file_write(kempe_context *context, const char *path, kmp_text *text);

/** Writes a text, not empty, so that it is whole or absent even after a loss of power, and frees it. KEMPE_E_IO,
 * KEMPE_E_MEMORY. */
kempe_status kmp_file_write_lasting(kempe_context *context, const char *path, kmp_text *text);

/** Makes a file with its content unless there is one of this name: of several processes, one alone has *made. */
kempe_status kmp_file_make(kempe_context *context, const char *path, const char *text, bool lasting, bool *made);

/** The ending of a file's name with its point, ".csv"; "": it has none. */
const char *kmp_file_ending(const char *path);

/** The file of a folder with this ending, ".urdf", the first one by name; NULL: none, or no memory. Free with kmp_free.
 *  `*count`: how many files have it. */
char *kmp_folder_find(const char *folder, const char *ending, int *count);

/** A file that is written piece by piece and has its name when it is whole. */
typedef struct kmp_file_stream kmp_file_stream;
kempe_status kmp_file_stream_new(kempe_context *context, const char *path, kmp_file_stream **stream);
/** Writes the text and empties it. */
kempe_status kmp_file_stream_put(kmp_file_stream *stream, kmp_text *text);
/** Gives the file its name; frees the stream in any case. */
kempe_status kmp_file_stream_end(kmp_file_stream *stream);
/** Frees a stream without its file. NULL is allowed. */
void kmp_file_stream_free(kmp_file_stream *stream);

/** Makes a folder unless it is there. KEMPE_E_IO with the system's reason. */
kempe_status kmp_folder_make(kempe_context *context, const char *path);
