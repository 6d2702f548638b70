/* SPDX-License-Identifier: BSD-3-Clause */
/* Foreign models, converted to the YAML document that a user would have written; its nodes have the places of the
 * elements that they come from, so that the reader's messages point into the foreign file. */
#pragma once

#include "model/files/document.h"
#include "model/files/nodes.h"
#include "model/files/xml.h"
#include "model/files/yaml.h"

/** A conversion at work. */
typedef struct kmp_import {
    kempe_context *context;
    kmp_arena *arena; /* of the document */
    const char *file;
    kmp_base base;
    const kmp_include_files *beside; /* for files that it includes */
    const kmp_element *model;        /* the outermost element; NULL: the file is in YAML */
    const kmp_yaml *source;          /* then its outermost mapping */
    kmp_yaml *root;                  /* the document */
    kempe_status status;             /* of the first complaint */
    const char *format;              /* of the rows of grammar.def */
    bool refused;                    /* something is not used that must be: an error at the end */
    int limited;                     /* joints whose limits are not used */
    kmp_place first_limit;           /* of the first one */
    struct kmp_mbs_name *names;      /* of a model of ROBOTRAN */
    int name_count;
} kmp_import;

/** True if a file is foreign, by the ending of its name or by its first sign. */
bool kmp_is_foreign(const char *file, const char *text, size_t length);

/** The contract of kmp_yaml_load. Parts that are not used are named in the log. */
kempe_status kmp_foreign_load(kempe_context *context, kmp_arena *arena, const char *file, int number, const char *text,
                              size_t length, kmp_base base, const kmp_include_files *beside, const kmp_yaml **root);

/** Converts a document of YAML that is in a foreign format; otherwise `*root` is unchanged. */
kempe_status kmp_foreign_convert(kempe_context *context, kmp_arena *arena, const char *file, kmp_base base,
                                 const kmp_include_files *beside, const kmp_yaml **root);

/* The conversions, by their rows in formats.def. Errors are in import->status. */
void kmp_mbs_convert(kmp_import *import);
void kmp_urdf_convert(kmp_import *import);
void kmp_laas_convert(kmp_import *import);
void kmp_mjcf_convert(kmp_import *import);
void kmp_sdf_convert(kmp_import *import);

/* importing.c */

/** "WHAT 'NAME' SENTENCE" as an error at a place. */
void kmp_import_complain(kmp_import *im, kmp_place place, const char *what, const char *name, const char *sentence);

/** An empty mapping; an entry of a mapping; a list of three numbers, printed so that they are read back exactly. */
kmp_yaml *kmp_import_map(kmp_import *im, kmp_place place);
void kmp_import_put(kmp_import *im, kmp_yaml *map, kmp_place place, const char *key, const kmp_yaml *item);
void kmp_import_word(kmp_import *im, kmp_yaml *map, kmp_place place, const char *key, const char *word);
kmp_yaml *kmp_import_numbers(kmp_import *im, kmp_place place, int count, const double *values);
const char *kmp_import_number(kmp_import *im, double value);

/** The mapping or list under a key, made when it is not there. */
kmp_yaml *kmp_import_part(kmp_import *im, kmp_yaml *map, const char *key, kmp_yaml_kind kind);

/** Appends an entry to a section; each name occurs once in it, otherwise that is an error at `from`. */
void kmp_import_add(kmp_import *im, const char *section, const kmp_element *from, const char *name,
                    const kmp_yaml *entry);

/** True for characters of Kempe's names. */
bool kmp_import_is_letter(char c);

/** A name with letters, digits and _ alone, not beginning with a digit, and not `ground`. NULL: no memory. */
const char *kmp_import_clean(kmp_import *im, const char *name);

/** Classes of the parts of a foreign model that are not used. Mechanics acts always: it is an error unless the context
 * leaves it out by its name; then results have a warning and are not trustworthy. Parts act at times if a surface is
 * touched, a limit is reached, a controller is commanded: they are a warning of the reading and of all results, in a
 * strict context an error. Drawings and remarks are mentioned. */
typedef enum kmp_part_class { KMP_PART_READ, KMP_PART_MECHANICS, KMP_PART_AT_TIMES, KMP_PART_REMARK } kmp_part_class;

/** Names something that is not used, with its place, by the class of the element or attribute `part`. */
void kmp_import_leave_out(kmp_import *im, kmp_place place, kmp_part_class kind, const char *part, const char *sentence,
                          ...) __attribute__((format(printf, 5, 6)));

/** Names what the model has and Kempe does not read, by the rows of grammar.def, each kind at its first place. An
 * element or attribute without a row is mechanics. */
void kmp_import_note_unknown(kmp_import *im);
