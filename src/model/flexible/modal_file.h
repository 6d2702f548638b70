/* SPDX-License-Identifier: BSD-3-Clause */
/* Files of flexible bodies: arrays, and the formats of a wing (base/wings.h). */
#pragma once

#include "model/flexible/modal_body.h"

/** The largest body of a file. Entries are at most KMP_MODAL_LARGEST, so that squares and their sums are numbers. */
enum { KMP_MODAL_MODES_MOST = 200, KMP_MODAL_PLACES_MOST = 100 };
#define KMP_MODAL_LARGEST 1e100

/** Units of a file in SI; 0: the file says them. */
typedef struct kmp_modal_units {
    double length, mass;
} kmp_modal_units;

/** Places of nodes in addition to the file: of the model, in metres, and a text with them; NULL: none. */
typedef struct kmp_modal_nodes {
    int count;
    const int *number;
    const double *at; /* count x 3 */
    const char *text;
} kmp_modal_nodes;

/** The content of a file. `first`: it has terms of second order; `whole`: these cannot be left out. */
typedef struct kmp_modal_file {
    kmp_modal_body body;
    const char **names; /* of the body's places */
    bool first, whole;
    const char *doubt; /* what it lacks, a sentence; NULL: nothing */
    int line, column;  /* of a mistake in a text; 0: of the file */
    bool beside;       /* the text describes the nodes */
} kmp_modal_file;

/** A file while it is read, and where its content and the mistake go. */
typedef struct kmp_modal_source {
    kmp_arena *arena;
    const char *bytes; /* `length` of them, and a zero */
    size_t length;
    const kmp_modal_units *units;
    const kmp_modal_nodes *nodes;
    kmp_modal_file *to;
    kmp_text *why;
} kmp_modal_source;

/** A format of files: the ending of their names in small letters, what they are, their reader, whether places of nodes
 * may be given in addition; without a reader, what to do instead. */
typedef struct kmp_modal_format {
    const char *ending, *what;
    bool (*read)(const kmp_modal_source *source);
    bool beside;
    const char *instead;
} kmp_modal_format;

/** Says what is wrong, unless something was said before; at a line and column of a text. They return false. */
bool kmp_modal_refuse(const kmp_modal_source *source, const char *format, ...) __attribute__((format(printf, 2, 3)));
bool kmp_modal_refuse_at(const kmp_modal_source *source, int line, int column, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

/** True if the content is a text; otherwise that is said. */
bool kmp_modal_is_text(const kmp_modal_source *source);

/** True if the model has the units of a file that does not say them. */
bool kmp_modal_scaled(const kmp_modal_source *source);

/** Makes the numbers of a body SI, from units of length, mass and time. */
void kmp_modal_convert(kmp_modal_body *body, const double unit[3]);

/** Units of length, mass and time in SI, from words such as "m kg s" and "mm t s". False: they are others. */
bool kmp_modal_units_find(const char *words, double units[3]);

/** Reads and checks a file by the ending of its name, into the arena. False: `why` names the part, the number and what
 * to do; or there is no memory. */
bool kmp_modal_file_read(const char *name, const kmp_modal_source *source);
