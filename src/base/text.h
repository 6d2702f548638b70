/* SPDX-License-Identifier: BSD-3-Clause */
/* Growing text. Failure is sticky: after it every call is a no-op and kmp_text_take returns NULL. */
#pragma once

#include "base/arena.h"
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct kmp_text {
    char *s;
    size_t length, capacity;
    bool failed;
} kmp_text;

void kmp_text_printf(kmp_text *text, const char *format, ...) __attribute__((format(printf, 2, 3)));
void kmp_text_vprintf(kmp_text *text, const char *format, va_list arguments) __attribute__((format(printf, 2, 0)));
/** Appends the arguments of a function that ends in `format, ...`. */
#define KMP_TEXT_ARGUMENTS(text, format)                                                                               \
    do {                                                                                                               \
        va_list kmp_arguments;                                                                                         \
        va_start(kmp_arguments, format);                                                                               \
        kmp_text_vprintf((text), (format), kmp_arguments);                                                             \
        va_end(kmp_arguments);                                                                                         \
    } while (0)

void kmp_text_put(kmp_text *text, const char *s);
void kmp_text_append(kmp_text *text, const char *bytes, size_t length);

/** Appends `s` as a JSON string, quotes included. */
void kmp_text_quote(kmp_text *text, const char *s);

/** Appends `s` as a word of a POSIX shell: in single quotes if it has characters that mean something to a shell. */
void kmp_text_shell(kmp_text *text, const char *s);

/** Appends `s` escaped for XML or HTML: <, > and & are replaced. */
void kmp_text_escape(kmp_text *text, const char *s);

/** The first character of `s` that names, messages and files must not have: a control character, one that turns the
 * direction of text or ends a line, or a byte that is not UTF-8. *length: of its bytes; *code: its number. NULL: there
 * is none. */
const char *kmp_text_unfit(const char *s, int *length, unsigned *code);
/** Puts `by` in place of each byte of these. */
void kmp_text_clean(char *s, char by);

/** Appends a number with the shortest digits (up to 17) that read back to the same double; "null" when not finite. */
void kmp_text_number(kmp_text *text, double x);

/** Appends a number rounded to `digits` digits (at most 17). */
void kmp_text_rounded(kmp_text *text, double x, int digits);

/** Reads a plain number (digits, point, exponent; no sign, hex, inf or nan) at the beginning of `s`, independent of the
 * locale. Returns the number of characters read; 0: `s` begins otherwise. */
size_t kmp_text_to_number(const char *s, double *value);

/** Splits a list at commas, without surrounding blanks, into `arena`. Empty words and a NULL list give none. The number
 * of words; 0 when there is no memory. */
int kmp_text_words(kmp_arena *arena, const char *list, char ***words);

/** Behind the first place where a text has a word: letters, digits and _ of it are next to no others. NULL: it has not.
 */
const char *kmp_text_behind_word(const char *text, const char *word);

/** A string in an arena; NULL without memory. */
char *kmp_arena_printf(kmp_arena *arena, const char *format, ...) __attribute__((format(printf, 2, 3)));

/** Gives the finished string to the caller (free with kmp_free) and empties `text`; NULL on failure. */
char *kmp_text_take(kmp_text *text);

/** Moves the string to `arena` and empties `text`; NULL, and the arena has failed, when there is no memory. */
char *kmp_text_keep(kmp_text *text, kmp_arena *arena);
void kmp_text_free(kmp_text *text);

/** Frees a part of a text, which has failed where the part had. */
void kmp_text_free_part(kmp_text *text, kmp_text *part);

/** A hash of a text (FNV-1a). */
uint32_t kmp_text_hash(const char *text);
