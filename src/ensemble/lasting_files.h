/* SPDX-License-Identifier: BSD-3-Clause */
/* Files that are whole or absent also for other processes, and after a loss of power. */
#pragma once

#include "base/context.h"
#include "base/text.h"

/** Writes a text, not empty, so that it is whole or absent even after a loss of power, and frees it. KEMPE_E_IO,
 * KEMPE_E_MEMORY. */
kempe_status kmp_lasting_file_write(kempe_context *context, const char *path, kmp_text *text);

/** Makes a file with its content unless there is one of this name: of several processes, only one has *made. */
kempe_status kmp_file_make(kempe_context *context, const char *path, const char *text, bool lasting, bool *made);

/** A file that is written piece by piece and has its name when it is whole. */
typedef struct kmp_file_stream kmp_file_stream;
kempe_status kmp_file_stream_new(kempe_context *context, const char *path, kmp_file_stream **stream);
/** Writes the text and empties it. */
kempe_status kmp_file_stream_put(kmp_file_stream *stream, kmp_text *text);
/** Gives the file its name; frees the stream in any case. */
kempe_status kmp_file_stream_end(kmp_file_stream *stream);
/** Frees a stream without its file. NULL is allowed. */
void kmp_file_stream_free(kmp_file_stream *stream);
