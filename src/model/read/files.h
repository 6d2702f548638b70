/* SPDX-License-Identifier: BSD-3-Clause */
/* The files of a model, and errors in their order: each message is `label:line:column: sentence`, which is parsed
 * again for sorting. */
#pragma once

#include "model/read/reading.h"

/** Appends a row to the model's files, whose label precedes line and column of messages; -1: no memory. */
int kmp_reader_add_file(kmp_reader *r, const char *label);

/** kmp_document_load for file `number` of the model. */
kempe_status kmp_reader_load(kmp_reader *r, int number, const char *text, size_t length, kmp_base base,
                             const kmp_yaml **root);

/** Adds a text that is read to the digest, with the ending of its file's name, which decides on its format. */
void kmp_reader_digest(kmp_reader *r, const char *path, const char *text, size_t length);

/** Logs a warning that the results of the model keep, too. */
void kmp_reader_warn(kmp_reader *r, kmp_place place, const char *format, ...) __attribute__((format(printf, 3, 4)));

/** Sorts the context's errors by place and drops repeated ones. */
kempe_status kmp_reader_sort_complaints(kmp_reader *r);
