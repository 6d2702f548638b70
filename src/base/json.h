/* SPDX-License-Identifier: BSD-3-Clause */
/* A JSON writer over growing text. Keys are in the order of the calls, numbers have the digits that read back to the
 * same double, null where they are not finite. */
#pragma once

#include "base/text.h"
#include <stdint.h>

enum { KMP_JSON_DEPTH = 16 };

typedef enum kmp_json_layout {
    KMP_JSON_LINES,   /* one member per line, two spaces per level */
    KMP_JSON_COMPACT, /* without blanks, and safe inside a script of a page */
    KMP_JSON_DENSE,   /* on one line but for kmp_json_line */
    KMP_JSON_WORDS    /* a summary instead: "key value, key value", without quotes and brackets of objects and arrays */
} kmp_json_layout;

typedef struct kmp_json {
    kmp_text *text;
    kmp_json_layout layout;
    int depth;
    int digits;       /* of numbers without a number of digits; 0: all */
    bool filled;      /* the open object or array has a member already */
    const char *line; /* begins the next member in place of a blank, NULL: a blank */
    char close[KMP_JSON_DEPTH];
} kmp_json;

kmp_json kmp_json_begin(kmp_text *text);
kmp_json kmp_json_begin_as(kmp_text *text, kmp_json_layout layout);

/** The next member of a dense object begins with this text: "\n", with blanks for an indentation. */
void kmp_json_line(kmp_json *json, const char *line);

/** Each of these writes one member: `key` is NULL inside an array and for the outermost value. */
void kmp_json_object(kmp_json *json, const char *key);
void kmp_json_array(kmp_json *json, const char *key);
void kmp_json_number(kmp_json *json, const char *key, double x);
void kmp_json_rounded(kmp_json *json, const char *key, double x, int digits);
void kmp_json_whole(kmp_json *json, const char *key, long x);
void kmp_json_string(kmp_json *json, const char *key, const char *s); /* null for NULL */
void kmp_json_text(kmp_json *json, const char *key, kmp_text *s);     /* a string, which is freed */
void kmp_json_boolean(kmp_json *json, const char *key, bool x);

/** Members by a template: keys with a value each, separated by blanks. %g is a number, %.3g one of 3 digits, %d or %ld
 * a whole one, %s a string or null for NULL, %i a boolean; { and [ open an object or an array, } and ] close it. Inside
 * an array there are no keys. Inside an object %s in the place of a key is one: "%s { low %g high %g }". */
void kmp_json_put(kmp_json *json, const char *format, ...) __attribute__((format(printf, 2, 3)));

/** An array of numbers on one line. */
void kmp_json_numbers(kmp_json *json, const char *key, int count, const double *x);
void kmp_json_rounded_numbers(kmp_json *json, const char *key, int count, const double *x, int digits);

/** Closes the innermost object or array; the outermost one with a newline. */
void kmp_json_end(kmp_json *json);
