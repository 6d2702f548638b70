/* SPDX-License-Identifier: BSD-3-Clause */
/* Texts of lines of numbers between blanks or commas, with exponents of C and of Fortran: 1.5e-3, 1.5D-3, 1.5-103. */
#pragma once

#include "base/context.h"
#include "base/file.h"

typedef struct kmp_number_lines {
    kempe_context *context;
    const char *path;
    char *text; /* of the file, cut into lines */
    size_t length, next;
    int line;
    char *now; /* the line */
} kmp_number_lines;

/** Reads the file; to be closed in any case. */
kempe_status kmp_number_lines_open(kempe_context *context, kmp_file_kind kind, const char *path,
                                   kmp_number_lines *lines);
void kmp_number_lines_close(kmp_number_lines *lines);

/** Goes on to the next line that is not blank, `now`. False: there is none. */
bool kmp_number_lines_next(kmp_number_lines *lines);

/** Takes a number at *at, behind blanks and a comma; *at moves past it. False, and *at is where it should be: there is
 * none. */
bool kmp_number_take(const char **at, double *value);

/** True if nothing but blanks and commas is left. */
bool kmp_number_line_ends(const char *at);

/** An error at a place of the line. KEMPE_E_INPUT. */
kempe_status kmp_number_lines_refuse(const kmp_number_lines *lines, const char *at, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/** The line as `count` numbers and no more. KEMPE_E_INPUT: it is not; `what` says what is expected. */
kempe_status kmp_number_lines_take(const kmp_number_lines *lines, int count, double *values, const char *what);
