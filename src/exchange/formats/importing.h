/* SPDX-License-Identifier: BSD-3-Clause */
/* Foreign formats by their first sign, and the parts of which their conversions make a document. */
#pragma once

#include "exchange/formats/formats.h"

/** True if a file is foreign, by the ending of its name or by its first sign. */
bool kmp_is_foreign(const char *file, const char *text, size_t length);

/** The contract of kmp_yaml_load. Parts that are not used are named in the log. */
kempe_status kmp_foreign_load(kempe_context *context, kmp_arena *arena, const char *file, int number, const char *text,
                              size_t length, kmp_base base, const kmp_include_files *beside, const kmp_yaml **root);

/** Converts a document of YAML that is in a foreign format; otherwise `*root` is unchanged. */
kempe_status kmp_foreign_convert(kempe_context *context, kmp_arena *arena, const char *file, kmp_base base,
                                 const kmp_include_files *beside, const kmp_yaml **root);

/** "WHAT 'NAME' SENTENCE" as an error at a place. */
void kmp_import_complain(kmp_import *im, kmp_place place, const char *what, const char *name, const char *sentence);

/** An empty mapping; entries of a mapping; a list of numbers, printed so that they are read back exactly. */
kmp_yaml *kmp_import_map(kmp_import *im, kmp_place place);
void kmp_import_put(kmp_import *im, kmp_yaml *map, kmp_place place, const char *key, const kmp_yaml *item);
void kmp_import_word(kmp_import *im, kmp_yaml *map, kmp_place place, const char *key, const char *word);
kmp_yaml *kmp_import_numbers(kmp_import *im, kmp_place place, int count, const double *values);
void kmp_import_value(kmp_import *im, kmp_yaml *map, kmp_place place, const char *key, double value);
void kmp_import_vector(kmp_import *im, kmp_yaml *map, kmp_place place, const char *key, const double v[3]);

/** The mapping or list under a key, made when it is not there. */
kmp_yaml *kmp_import_part(kmp_import *im, kmp_yaml *map, const char *key, kmp_yaml_kind kind);

/** Appends an entry to a section; each name occurs once in it, otherwise that is an error at `from`. */
void kmp_import_add(kmp_import *im, const char *section, const kmp_element *from, const char *name,
                    const kmp_yaml *entry);

/** True for a word of a list, in which each has a blank before it and after it. */
bool kmp_import_is_word(const char *words, const char *name);

/** True for characters of Kempe's names. */
bool kmp_import_is_letter(char c);

/** A name with only letters, digits and _, not beginning with a digit, and not `ground`. NULL: no memory. */
const char *kmp_import_clean(kmp_import *im, const char *name);

/** Names something that is not used, with its place, by the class of the element or attribute `part`. */
void kmp_import_leave_out(kmp_import *im, kmp_place place, kmp_part_class kind, const char *part, const char *sentence,
                          ...) __attribute__((format(printf, 5, 6)));

/** Names what the model has and Kempe does not read, by the rows of grammar.def, each kind at its first place. An
 * element or attribute without a row is mechanics. */
void kmp_import_note_unknown(kmp_import *im);
