/* SPDX-License-Identifier: BSD-3-Clause */
/* Foreign models, converted to the YAML document that a user would have written; its nodes have the places of the
 * elements that they come from, so that the reader's messages point into the foreign file. */
#pragma once

#include "exchange/formats/xml.h"
#include "model/files/document.h"
#include "model/files/nodes.h"
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

/** Classes of the parts of a foreign model that are not used. Mechanics acts always: it is an error unless the context
 * leaves it out by its name; then results have a warning and are not trustworthy. Parts act at times if a surface is
 * touched, a limit is reached, a controller is commanded: they are a warning of the reading and of all results, in a
 * strict context an error. Drawings and remarks are mentioned. A part that is read WHOLE has words of a separate
 * vocabulary, which its reader judges. */
typedef enum kmp_part_class {
    KMP_PART_READ,
    KMP_PART_WHOLE,
    KMP_PART_MECHANICS,
    KMP_PART_AT_TIMES,
    KMP_PART_REMARK
} kmp_part_class;

/* The conversions. Errors are in import->status. */
#define KMP_FORMAT(outermost, ending, convert, name) void convert(kmp_import *import);
#define KMP_FORMAT_OF_KEY(key, convert)              void convert(kmp_import *import);
#include "exchange/formats/formats.def"
