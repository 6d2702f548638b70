/* SPDX-License-Identifier: BSD-3-Clause */
/* Texts of lines with numbers as Fortran writes them: 1.5, -2, +.25E-3, 1.0D+02, and 1.0+2 of bulk data. */
#pragma once

#include <stdbool.h>
#include <stddef.h>

/** A line without its end, and what of the text follows it. */
typedef struct kmp_text_line {
    const char *s;
    size_t length;
    int number, column; /* of the line and of its first character, from 1 */
    const char *rest;
} kmp_text_line;

/** The line after `line`; first of all, one with the text as its rest. False: there is none. */
bool kmp_text_line_next(kmp_text_line *line);

/** Removes blanks at both ends. */
void kmp_text_line_trim(kmp_text_line *line);

/** Reads a number that is all of `length` characters, but for blanks around it. False: it is none, or is not finite. */
bool kmp_fortran_number(const char *s, size_t length, double *value);

/** Likewise, a whole number of at most nine digits. */
bool kmp_fortran_whole(const char *s, size_t length, int *value);
