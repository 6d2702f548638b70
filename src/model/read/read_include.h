/* SPDX-License-Identifier: BSD-3-Clause */
/* Included models. The mappings of an included file are merged with the mappings of the including file before anything
 * is read. */
#pragma once

#include "model/read/reading.h"

extern const kmp_key kmp_include_keys[];

/** Merges the model's included files into r->root. */
void kmp_read_includes(kmp_reader *r);

/** NULL for the model's own file. */
const kmp_include_instance *kmp_reader_instance(const kmp_reader *r, int file);

/** A name in a file, as the model has it: with the file's prefix. */
const char *kmp_reader_name(kmp_reader *r, int file, const char *name);

/** A name that the model has, as its own file has it: without the file's prefix. */
const char *kmp_reader_own_name(const kmp_reader *r, int file, const char *name);

/** A start value set at `again` after `before`: true where the file of `before` includes the file of `again`, and
 * takes precedence. Otherwise it is given twice, which is an error. */
bool kmp_reader_said(kmp_reader *r, const char *what, const kmp_yaml *again, kmp_place before);

/** The model's name of a body; the ground of an included file is the body that it is put on. */
const char *kmp_reader_body_name(kmp_reader *r, int file, const char *name);

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
