/* SPDX-License-Identifier: BSD-3-Clause */
/* Writes the files of any language: fills in its templates. */
#pragma once

#include "exchange/code/language.h"

/** Fills in a template. */
void kmp_fill(const kmp_code_writer *writer, const char *pattern);

/** True if the language has the operation. */
bool kmp_language_has(const kmp_language *language, kmp_op op);

/** Writes all files. false: no memory. */
bool kmp_language_write(const kmp_language *language, const kmp_code_source *source, kmp_code_files *files);

/** Appends a number that reads back to the same double, with a point or an exponent. */
void kmp_language_number(kmp_text *text, const kmp_language *language, double x);

/** Appends a string in the language's quotes. */
void kmp_language_string(kmp_text *text, const kmp_language *language, const char *s);

/** The beginning of item k of a list; the end of a list with `count` items. */
void kmp_put_list_item(kmp_text *text, const kmp_list_spelling *list, int k);
void kmp_list_end(kmp_text *text, const kmp_list_spelling *list, int count);

/** A list of numbers. */
void kmp_put_numbers(kmp_text *text, const kmp_language *language, const kmp_list_spelling *list, int count,
                     const double *x);
