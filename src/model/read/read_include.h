/* SPDX-License-Identifier: BSD-3-Clause */
/* Included models. The mappings of an included file are merged with those of the including file before anything is
 * read. */
#pragma once

#include "model/read/reading.h"

extern const kmp_key kmp_include_keys[];

/** Merges the model's included files into r->root. */
void kmp_read_includes(kmp_reader *r);

/** NULL for the model's own file. */
const kmp_include_instance *kmp_reader_instance(const kmp_reader *r, int file);

/** A name in a file, as the model has it: with the file's prefix. */
const char *kmp_reader_name(kmp_reader *r, int file, const char *name);

/** A start value set at `again` after `before`: true where the file of `before` includes that of `again`, and takes
 * precedence. Otherwise it is given twice, which is an error. */
bool kmp_reader_said(kmp_reader *r, const char *what, const kmp_yaml *again, kmp_place before);

/** The model's name of a body; the ground of an included file is the body that it is put on. */
const char *kmp_reader_body_name(kmp_reader *r, int file, const char *name);
