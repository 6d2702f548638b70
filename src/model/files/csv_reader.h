/* SPDX-License-Identifier: BSD-3-Clause */
/* CSV files read line by line: a header, then rows. Blank lines and comments (#) are passed over. A unit follows the
 * name of its column, "q.crank [deg]", or is in a comment "# units: s,deg" before the header; else a column is in
 * SI. Errors name file, line and column. */
#pragma once

#include "base/arena.h"
#include "base/context.h"

/** A field of a line, without surrounding blanks. */
typedef struct kmp_csv_field {
    const char *s;
    size_t length;
} kmp_csv_field;

struct kmp_csv;

/** The form of a file: errors, and the functions that take its lines. They return false without memory. */
typedef struct kmp_csv_form {
    const char *lacks_header, *lacks_rows; /* errors of a file without one, and without any; NULL: it may have none */
    bool (*header)(struct kmp_csv *csv, const char *line);
    bool (*row)(struct kmp_csv *csv, const char *line);
    bool foreign; /* columns that are not read may have any name and unit, and rows may end before them */
} kmp_csv_form;

typedef struct kmp_csv {
    kempe_context *context;
    const char *path;
    const kmp_csv_form *form;
    void *user;
    int columns; /* in the header: kmp_csv_row compares with it */
    int line, rows, complaints;
    const char *line_text;
    kmp_arena arena;       /* units */
    const char *units;     /* the rest of their comment; NULL: there is none */
    struct kmp_unit *unit; /* columns */
} kmp_csv;

/** Reads the file, up to some errors. KEMPE_E_IO, KEMPE_E_INPUT, KEMPE_E_MEMORY. */
kempe_status kmp_csv_read(kempe_context *context, const char *path, const kmp_csv_form *form, void *user);

/** The same of the text of a file, which is changed. */
kempe_status kmp_csv_read_text(kempe_context *context, const char *path, char *text, size_t length,
                               const kmp_csv_form *form, void *user);

/** An error at a character of the line; false once too many have been reported. */
void kmp_csv_complain(kmp_csv *csv, const char *at, const char *format, ...) __attribute__((format(printf, 3, 4)));
bool kmp_csv_goes_on(const kmp_csv *csv);

/** The field that begins at *s; *s moves past the comma after it, to NULL after the last one. */
kmp_csv_field kmp_csv_next(const char **s);
bool kmp_csv_is(kmp_csv_field field, const char *word);

/** In the header: the next field without its unit. */
kmp_csv_field kmp_csv_name(const char **s);

/** In the header of a foreign file: a column that is read has a unit that exists, or none. *given: it has one. */
bool kmp_csv_has_unit(kmp_csv *csv, int column, const char *at, bool *given);

/** In the header: the column that is named at `at` must fit a unit of SI; "": any unit. */
void kmp_csv_check_unit(kmp_csv *csv, int column, const char *at, const char *si);

/** A finite number with an optional sign that fills the field, converted from the unit of the column to SI. */
bool kmp_csv_number(const kmp_csv *csv, int column, kmp_csv_field field, double *value);

/** The number of fields of a line. */
int kmp_csv_count(const char *line);

/** Complains when a row has another number of fields than the header has columns. */
void kmp_csv_check_row(kmp_csv *csv, const char *line);
